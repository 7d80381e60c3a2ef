// Keyframes wait on the vehicle's disk until the daemon has them on its own: nothing that Put
// accepted is lost with the program, the link or the power. One file a keyframe, numbered in the
// order of Put. One thread at a time, and one spool a folder, which it holds locked.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "client/connection/atlas_client.h"
#include "client/connection/keyframe_uploader.h"
#include "client/vehicle/folder_lock.h"
#include "client/vehicle/sent_atlas.h"
#include "core/base/status.h"

namespace atlas {

struct SpoolOptions {
  std::filesystem::path folder;
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  // of waiting keyframes
  // Of those that were refused: the oldest go first.
  std::uint64_t max_refused_bytes = std::uint64_t{256} << 20;
  UploadOptions upload = {};  // without its patience: Send has an end
  // The most, and half of it the least, for which nothing more is sent on a connection whose client
  // may not upload at all: that takes people to undo.
  std::chrono::milliseconds denied_delay{60'000};
  std::function<double()> random = {};  // uniform in [0, 1); empty: the system's
};

// Of one Send.
struct SendLimits {
  std::chrono::milliseconds deadline{10'000};
  std::uint64_t budget_bytes = 0;  // of files; the one that reaches it is the last. 0: none
};

struct SpoolReport {
  std::uint64_t acknowledged = 0;  // and gone from the disk; duplicates among them
  std::uint64_t set_aside = 0;     // refused for good or damaged; with a .reason beside each
  // Could not be read, set aside or, once acknowledged, deleted, or the daemon failed at them and
  // not at others: they wait, the last kind for two more times. What the daemon has is not sent
  // again, but by another run of the program, and deleted by a later Send.
  std::uint64_t skipped = 0;
  std::uint64_t vanished = 0;  // removed by somebody else: forgotten
  // The first file's of those skipped or vanished, or else of the one that says which atlas was
  // sent to last: damaged, it is as if nothing was sent yet.
  Status problem;
  std::uint64_t sent = 0;  // answered or not
  std::uint64_t sent_bytes = 0;
  // What is left on the disk, and how many of these are on their way: the next Send on the same
  // connection begins with their answers.
  std::uint64_t waiting = 0;
  std::uint64_t in_flight = 0;
  // The atlas was restored from a backup since this spool sent to it last, in this run of the
  // program or an earlier one, or it is another atlas: of what was acknowledged before some may be
  // lost, and is to be put again by who still has it. Told once.
  bool is_restored = false;
  // Not 0: nothing was sent, the daemon wants to be left alone for so long, or said that the client
  // may not upload at all.
  std::chrono::milliseconds retry_after{0};
};

class UploadSpool {
 public:
  // What a killed program left is put in order. Reads names only. kConflict: another spool has the
  // folder.
  static Result<UploadSpool> Open(const SpoolOptions& options);

  UploadSpool(const UploadSpool&) = delete;
  UploadSpool& operator=(const UploadSpool&) = delete;
  UploadSpool(UploadSpool&&) noexcept;
  UploadSpool& operator=(UploadSpool&&) noexcept;
  ~UploadSpool();

  // On the disk when it returns. kResourceExhausted when there is no room, kInvalidArgument for a
  // name or a size that no daemon takes; nothing was written then.
  Status Put(const KeyframeUpload& upload);
  // Oldest first, as many at a time as the options say, until the limits end it; the next call goes
  // on where it ended. On another connection what was not answered is sent again. Fails when the
  // link does, with the first refusal that may pass (what waits is kept then), or when the client
  // may not upload at all. Sends nothing while the daemon wants to be left alone
  // (AtlasClient::retry_after), nor for a while after the latter; then one keyframe, and the others
  // when it was taken. A file that is of no use stops no other.
  Result<SpoolReport> Send(AtlasClient& client, const SendLimits& limits = {});

  // Puts what was refused back into the queue, at the places that it had, as far as there is room:
  // for when the reason is gone (a clock that was fast, another daemon). How many; fails only when
  // none could be moved.
  Result<std::size_t> RetryRefused();

  std::size_t waiting() const { return waiting_.size(); }
  std::size_t refused() const { return refused_.size(); }
  std::uint64_t waiting_bytes() const { return waiting_bytes_; }
  std::filesystem::path refused_folder() const { return options_.folder / "refused"; }

 private:
  using Number = std::uint64_t;
  class Sending;
  struct Underway;

  UploadSpool(SpoolOptions options, FolderLock lock);
  Status Scan();
  // The daemon has it. What cannot be deleted stays, is not sent again, and deleted later.
  Status Remove(Number number);
  // Moves it out of the queue, the reason first. kNotFound: it vanished, and waits no more.
  Status SetAside(Number number, const std::string& reason);
  // The bytes that it had.
  std::uint64_t Forget(Number number);
  // Back into the queue. kNotFound: it vanished, and is refused no more.
  Status PutBack(Number number);
  void TrimRefused();
  std::filesystem::path PathOf(Number number) const;

  SpoolOptions options_;
  FolderLock lock_;
  std::map<Number, std::uint64_t> waiting_;  // with the bytes of each
  std::map<Number, std::uint64_t> refused_;
  std::map<Number, int> failures_;      // of the daemon, at waiting ones
  std::set<Number> undeleted_;          // waiting ones that the daemon has
  std::unique_ptr<Underway> underway_;  // null: nothing
  std::uint64_t waiting_bytes_ = 0;
  std::uint64_t refused_bytes_ = 0;
  Number next_ = 1;
  SentAtlas sent_to_;
  bool is_probing_ = false;  // something was refused for a while, and nothing was taken since
};

}  // namespace atlas
