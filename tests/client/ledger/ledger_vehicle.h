// A vehicle that uploads, corrects poses, and retracts, restores, releases or purges sessions, for
// as long as it is let live. It asks nothing that its ledger does not say, and checks every answer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "client/vehicle/atlas_link.h"
#include "client/vehicle/upload_spool.h"
#include "tests/client/ledger/ledger.h"

namespace atlas::testing {

enum class VehicleKind {
  kDirect,  // sends again whatever was not answered, and now and then what was
  kResume,  // goes on behind what the handshake says is there
  kSpool,   // through the spool, which it fills without a link, too
  kLeap,    // as kDirect; its sessions are quarantined, and released instead of retracted
  kPurge,   // as kDirect; its sessions are purged instead
};

struct LedgerVehicleOptions {
  int number = 0;
  VehicleKind kind = VehicleKind::kDirect;
  std::filesystem::path ledger;
  std::filesystem::path spool;  // of kSpool
  std::uint16_t port = 0;       // of the daemon, on loopback
  std::uint32_t seed = 0;
};

class LedgerVehicle {
 public:
  // Throws where ledger or spool cannot be opened.
  explicit LedgerVehicle(const LedgerVehicleOptions& options);

  // Lives until an answer is wrong: what it was, which the ledger says as well.
  Status Run();

 private:
  // Ok, the link's failure, or a wrong answer.
  Status Step();
  Result<AtlasClient*> Connected();
  void MakeLink();
  Status NoteHandshake(const AtlasClient& client);

  Status Upload(AtlasClient& client);
  Status UploadAgain(AtlasClient& client);
  Status UploadPurged(AtlasClient& client, std::uint32_t session);
  Status SendFrames(AtlasClient& client,
                    const std::vector<FrameId>& frames,
                    std::size_t may_be_duplicates);
  Status Put();
  Status SendSpool(AtlasClient& client);
  Status MovePoses(AtlasClient& client);
  Status ChangeSession(AtlasClient& client);
  Status Change(AtlasClient& client, std::uint32_t session, SessionAction action, bool is_again);
  // nullopt: the session stays as it is.
  std::optional<SessionAction> DrawAction(std::uint32_t session);

  KeyframeUpload UploadOf(const FrameId& frame, ByteSpan blob) const;
  std::vector<FrameId> Unanswered() const;
  FrameId NextFrame() const;
  bool IsAcknowledged(const FrameId& frame) const;
  // Of a session, all that were sent: that many and more.
  bool AreAcknowledged(std::uint32_t session, std::size_t at_least) const;
  // One that the daemon has for certain, of no session that may be purged.
  std::optional<FrameId> DrawAcknowledged();
  std::uint32_t Below(std::uint32_t count) { return static_cast<std::uint32_t>(random_() % count); }
  const LedgerState& state() const { return ledger_.state(); }

  LedgerVehicleOptions options_;
  Ledger ledger_;
  std::mt19937 random_;
  std::unique_ptr<AtlasLink> link_;
  std::uint32_t resumed_session_ = 0;  // that the link names
  std::optional<UploadSpool> spool_;
  std::optional<std::uint32_t> lost_version_;  // of the batch that the link failed at
};

}  // namespace atlas::testing
