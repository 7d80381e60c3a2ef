// One cell of the plain fusion: its observations, its segments, its layers.
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "core/fusion/observation/sigma_table.h"
#include "core/fusion/tile_fusion.h"

namespace atlas::testing {

// One keyframe's word on one cell.
struct PlainObservation {
  const PlacedKeyframe* placed = nullptr;
  std::int32_t altitude_mm = 0;
  std::uint16_t distance_step = 0;
  AltitudeSource source = AltitudeSource::kNone;
  Occupancy occupancy = Occupancy::kUnknown;
  std::uint64_t column = 0;
  std::int32_t column_base = 0;

  bool is_strong() const { return source != AltitudeSource::kExtrapolated; }
};

class PlainCell {
 public:
  PlainCell(const MapProfile& profile, const SigmaTable& sigmas)
      : profile_(profile), sigmas_(sigmas) {}

  // The layers of a cell from its observations in canonical order, lowest first; adds to `used` a
  // key of each session that took part.
  void Fuse(std::span<const PlainObservation> observations,
            std::set<const SessionKey*>& used,
            std::vector<TileLayer>& out);

 private:
  struct Segment {
    const PlacedKeyframe* first = nullptr;
    const PlacedKeyframe* last = nullptr;
    const PlacedKeyframe* driven = nullptr;  // the last whose vehicle was there, while it holds
    const PlainObservation* representative = nullptr;
    std::int64_t weight = 0;
    std::int64_t weighted_mm = 0;
    std::int64_t observations = 0;
    int occupancy = 0;
    int column_base = 0;
    std::array<int, 16> column{};
    std::array<bool, 16> is_seen{};
    int layer = -1;
    bool is_kept = true;
  };
  struct Nearest {
    Segment* segment = nullptr;
    std::int64_t distance_mm = 0;
    std::size_t alike = 0;  // segments of the kind
  };
  struct Layer {
    int chained = 0;  // its number in the chain
    std::int64_t altitude_mm = 0;
    std::int64_t weight = 0;
    std::int64_t observations = 0;
    std::int64_t time_ms = 0;
    bool is_measured = false;
  };

  void FindSegments(std::span<const PlainObservation> observations);
  Nearest FindNearest(std::int64_t altitude_mm, bool is_strong, std::size_t stretch_begin);
  bool IsOneLayer(const PlainObservation& a, const PlainObservation& b) const;
  Segment& SegmentFor(const PlainObservation& observation, const Nearest& nearest);
  void AddTo(const PlainObservation& observation, std::int64_t weight, Segment& segment) const;
  struct Say {
    int units;
    bool is_vehicle;
    bool is_over_vehicle;
  };
  void Add(const Say& say, int& sum) const;
  void ReleaseOld(Segment& segment) const;
  static bool SpeaksOfVehicle(const PlainObservation& observation);
  void AddColumn(const PlainObservation& observation, Segment& segment) const;
  void KeepLatest();
  bool IsAlone(const Segment& segment) const;
  void ChainLayers(bool all_make);
  void SumLayer(Layer& layer) const;
  void KeepBestLayers();
  void AdoptWeak();
  TileLayer Publish(std::size_t index) const;
  std::uint64_t PublishColumn(std::span<const Segment* const> in_order, std::size_t index) const;

  const MapProfile& profile_;
  const SigmaTable& sigmas_;
  std::vector<Segment> segments_;
  std::vector<Segment*> makers_;
  std::vector<Layer> layers_;
};

}  // namespace atlas::testing
