// The surveys of tiles on disk: of those that memory has no room for, and for the time after a
// restart, when nothing is in memory. One file a tile, bounded by bytes, least recently used first
// out. Disposable: any of them may be damaged or gone at any time, which costs time only.
// Thread-safe.
//
// Nothing of the files is kept in memory. A file is believed if this very build wrote it, and if
// the atlas went on from the state that it was in then: not if another one, or an older copy, was
// put in its place (AtlasLine).
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>

#include "core/base/status.h"
#include "core/geometry/map_profile.h"
#include "server/service/fusion/kept_surveys.h"
#include "server/service/fusion/survey_file.h"
#include "server/service/fusion/survey_folder.h"
#include "server/service/log_sink.h"
#include "server/store/store_types.h"

namespace atlas {

struct SurveyFilesOptions {
  std::filesystem::path directory;               // made if there is none; empty: nothing is kept
  std::size_t max_bytes = std::size_t{4} << 30;  // 0: what is there is removed
  std::uintmax_t min_free_bytes = std::uintmax_t{1} << 30;  // others need the disk more
};

class SurveyFiles {
 public:
  // The line of the atlas as it is now.
  using ReadLine = std::function<Result<AtlasLine>()>;

  // Goes on with removing the files in the directory that cannot be believed, on a thread of its
  // own: after another program ran there may be tens of thousands.
  SurveyFiles(const SurveyFilesOptions& options,
              const MapProfile& profile,
              ReadLine read_line,
              LogSink log);
  SurveyFiles(const SurveyFiles&) = delete;
  SurveyFiles& operator=(const SurveyFiles&) = delete;
  ~SurveyFiles() = default;

  // Packed; none if there are none to be believed. The file stays: it can be gone on from again.
  std::optional<KeptSurveys> Read(const TileId& id);
  // False where the disk has no room or refuses. What it says is logged, and nothing is tried for a
  // minute then.
  bool Write(const KeptSurveys& kept);
  // Whether they are there as they are.
  bool Has(const KeptSurveys& kept) const;
  // Gives the oldest up while others need the disk more.
  void MakeRoom();

  bool is_on() const { return is_on_; }
  std::size_t bytes() const { return folder_.bytes(); }
  // What was there at the start has been looked at.
  bool is_sorted() const { return is_sorted_; }

 private:
  void SortFiles(const AtlasLine& line, const std::stop_token& stop);
  std::optional<SurveyFileHeader> Find(std::uint64_t key) const;
  Result<SurveyFileHeader> WriteFile(const KeptSurveys& kept);
  bool MayWrite() const;
  void Report(const std::string& what);

  SurveyFilesOptions options_;
  MapProfile profile_;
  ReadLine read_line_;
  LogSink log_;
  bool is_on_ = false;
  SurveyFolder folder_;
  mutable std::mutex mutex_;
  std::chrono::steady_clock::time_point not_before_;  // a write failed; under the lock
  std::atomic<bool> is_sorted_ = false;
  std::jthread sorter_;
};

}  // namespace atlas
