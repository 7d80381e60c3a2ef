// The surveys of tiles between two fusions of them, least recently used first out, bounded by
// bytes: what was used lately as it is, what was not for a while compressed, then on disk.
// Disposable: losing it costs time only. Thread-safe.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <unordered_set>

#include "core/base/lru_list.h"
#include "server/service/fusion/kept_surveys.h"
#include "server/service/fusion/survey_files.h"

namespace atlas {

struct SurveyCacheLimits {
  std::size_t plain_bytes = 0;
  std::size_t packed_bytes = 0;
  std::chrono::milliseconds idle = std::chrono::minutes(1);  // the vehicles are gone, most likely

  // Compressed ones take a sixth: there are more of them in their third.
  static SurveyCacheLimits OfTotal(std::size_t bytes) { return {bytes / 3 * 2, bytes / 3}; }
};

class SurveyCache {
 public:
  // `files` must outlive the cache.
  SurveyCache(const SurveyCacheLimits& limits, SurveyFiles& files)
      : limits_(limits), files_(files) {}

  // Takes a tile's surveys out, ready to be used; none if they are not there. Waits for those that
  // are just being compressed or written.
  std::optional<KeptSurveys> Take(const TileId& id);
  // Of two of a tile, those of the later revision stay. There may be too many until Trim().
  void Put(KeptSurveys kept);
  // Compresses what is too much as it is, then writes what is too much compressed. Now and then
  // what that left free goes back to the system: the next ones do not fit where these were.
  void Trim();
  // Writes one of those that were not used for a while and did not go to disk as they are, once:
  // there may be less room on disk than here. False: there is none, or it could not be. So a
  // process that is killed loses little.
  bool StoreIdle();
  // Writes what is in memory to the files; it is gone from it then. How many bytes are on disk.
  std::size_t MoveToDisk();
  std::size_t bytes() const;  // in memory

 private:
  using Time = std::chrono::steady_clock::time_point;
  using Lock = std::unique_lock<std::mutex>;

  struct Entry {
    KeptSurveys kept;
    Time used_at;
  };
  using Shelf = LruList<Entry>;

  // An entry that was taken out is worked on without the lock: others wait for its tile.
  class Work;

  void PutOn(Shelf& shelf, Entry entry);

  SurveyCacheLimits limits_;
  SurveyFiles& files_;
  mutable std::mutex mutex_;
  std::condition_variable done_;
  std::unordered_set<std::uint64_t> at_work_;
  Shelf plain_;
  Shelf packed_;
  std::size_t left_free_ = 0;  // bytes, since they went back last
};

}  // namespace atlas
