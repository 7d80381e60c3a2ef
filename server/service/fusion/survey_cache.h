// The surveys of tiles between two fusions of them, least recently used first out, bounded by
// bytes: what was used lately as it is, what was not for a while compressed, then on disk.
// Disposable: losing it costs time only. Thread-safe.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "server/service/fusion/kept_surveys.h"
#include "server/service/fusion/survey_files.h"

namespace atlas {

struct SurveyCacheLimits {
  std::size_t plain_bytes = std::size_t{1} << 30;
  std::size_t packed_bytes = std::size_t{512} << 20;
};

class SurveyCache {
 public:
  // `files` must outlive the cache.
  SurveyCache(const SurveyCacheLimits& limits, SurveyFiles& files)
      : limits_(limits), files_(files) {}

  // Takes a tile's surveys out, ready to be used; none if they are not there.
  std::optional<KeptSurveys> Take(const TileId& id);
  void Put(KeptSurveys kept);
  // Writes one of those that were not used for a minute and are not on disk as they are. False:
  // there is none. So a process that is killed loses little.
  bool StoreIdle();
  // Writes what is in memory to the files; it is gone from it then.
  void MoveToDisk();
  std::size_t bytes() const;  // in memory

 private:
  using Time = std::chrono::steady_clock::time_point;

  // One of the two: tiles by age, the last used first.
  struct Shelf {
    struct Entry {
      KeptSurveys kept;
      std::size_t bytes = 0;
      Time used_at;
    };
    std::list<Entry> by_age;
    std::unordered_map<std::uint64_t, std::list<Entry>::iterator> by_key;
    std::size_t bytes = 0;

    std::optional<Entry> Take(std::uint64_t key);
    void Put(KeptSurveys kept, Time used_at);
    std::optional<Entry> TakeIdle(Time before);
    std::optional<Entry> TakeOldestAbove(std::size_t limit);
  };

  SurveyCacheLimits limits_;
  SurveyFiles& files_;
  mutable std::mutex mutex_;
  Shelf plain_;
  Shelf packed_;
};

}  // namespace atlas
