// The surveys of tiles between two fusions of them, least recently used first out, bounded by
// bytes: what was used lately as it is, what was not for a while compressed. Disposable: losing it
// costs time only. Thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "core/fusion/tile_surveys.h"

namespace atlas {

struct KeptSurveys {
  TileSurveys surveys;
  std::uint64_t revision = 0;  // of the atlas that the tile was last made from
};

struct SurveyCacheLimits {
  std::size_t plain_bytes = std::size_t{1} << 30;
  std::size_t packed_bytes = std::size_t{512} << 20;
};

class SurveyCache {
 public:
  explicit SurveyCache(const SurveyCacheLimits& limits) : limits_(limits) {}

  // Takes a tile's surveys out, ready to be used; none if they are not there.
  std::optional<KeptSurveys> Take(const TileId& id);
  void Put(KeptSurveys kept);
  std::size_t bytes() const;

 private:
  // One of the two: tiles by age, the last used first.
  struct Shelf {
    struct Entry {
      KeptSurveys kept;
      std::size_t bytes = 0;
    };
    std::list<Entry> by_age;
    std::unordered_map<std::uint64_t, std::list<Entry>::iterator> by_key;
    std::size_t bytes = 0;

    std::optional<KeptSurveys> Take(std::uint64_t key);
    void Put(KeptSurveys kept);
    std::optional<KeptSurveys> TakeOldestAbove(std::size_t limit);
  };

  SurveyCacheLimits limits_;
  mutable std::mutex mutex_;
  Shelf plain_;
  Shelf packed_;
};

}  // namespace atlas
