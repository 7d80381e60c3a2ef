// Compares what an atlas holds with the ledgers of those who filled it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>

#include "tests/client/ledger/ledger.h"
#include "tests/client/ledger/stored_atlas.h"

namespace atlas::testing {

struct Verdict {
  std::uint64_t lost = 0;       // acknowledged, or there earlier, and not there
  std::uint64_t twice = 0;      // there more than once
  std::uint64_t foreign = 0;    // there, and nobody ever sent it
  std::uint64_t altered = 0;    // with another time or other bytes than were sent
  std::uint64_t misplaced = 0;  // at a pose older than the last acknowledged one, or at nobody's
  std::uint64_t torn = 0;       // pose batches that happened in part
  std::uint64_t misjudged = 0;  // sessions that are not as they look, and as nobody asked last
  std::uint64_t left = 0;       // there, of a session that was purged
  std::string first;            // finding, in words

  void Add(const Verdict& other);
  std::uint64_t faults() const {
    return lost + twice + foreign + altered + misplaced + torn + misjudged + left;
  }
};

class LedgerJudge {
 public:
  // What of a vehicle waits on its disk: its spool holds it, and the daemon need not have it.
  using Spooled = std::set<KeyframeKey>;

  explicit LedgerJudge(const StoredAtlas& atlas);

  void Judge(int vehicle, const LedgerState& ledger, const Spooled& spooled);
  // What was there is to be there still.
  void JudgeAgainst(const StoredAtlas& earlier);
  // After all vehicles.
  Verdict Finish();

 private:
  void JudgeFrames(int vehicle, const LedgerState& ledger, const Spooled& spooled);
  void JudgePoses(int vehicle, const LedgerState& ledger);
  void JudgeSessions(int vehicle, const LedgerState& ledger);
  // Of the session as it is: that which an action, or none, leaves.
  SessionState StateAfter(int vehicle,
                          std::uint32_t session,
                          std::optional<SessionAction> action) const;
  bool IsImplausible(int vehicle, std::uint32_t session) const;
  bool IsPurged(const SessionKey& key) const;
  void Note(std::uint64_t& fault, const std::string& what);

  const StoredAtlas& atlas_;
  std::set<KeyframeKey> known_;  // of some ledger
  Verdict verdict_;
};

// Throws where a file in the spool's folder is damaged, or one was refused.
LedgerJudge::Spooled ReadSpool(const std::filesystem::path& folder);

}  // namespace atlas::testing
