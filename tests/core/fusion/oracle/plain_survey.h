// One cell of the plain fusion: from its observations to the segments of each stretch, in preset
// paper of each session.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/observation/sigma_table.h"
#include "core/fusion/tile_fusion.h"

namespace atlas::testing {

// One keyframe's word on one cell.
struct PlainObservation {
  const PlacedKeyframe* placed = nullptr;
  std::uint64_t column = 0;
  std::int32_t column_base = 0;
  std::uint32_t stretch = 0;  // its number among those of the tile
  std::int32_t altitude_mm = 0;
  std::uint16_t distance_step = 0;
  AltitudeSource source = AltitudeSource::kNone;
  Occupancy occupancy = Occupancy::kUnknown;

  bool is_strong() const { return source != AltitudeSource::kExtrapolated; }
};

// What one stretch saw of one surface.
struct PlainSegment {
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
  bool is_strong = false;  // some of its observations are
  bool is_kept = true;
};

// Where a stretch's evidence stands when its vehicle itself was there.
bool IsStretchsLastWord(int evidence, const MapProfile& profile);

class PlainSurvey {
 public:
  PlainSurvey(const MapProfile& profile, const SigmaTable& sigmas)
      : profile_(profile), sigmas_(sigmas) {}

  // Observations in canonical order; they must outlive the segments, which live until the next
  // call.
  std::span<PlainSegment> Find(std::span<const PlainObservation> observations);

 private:
  std::span<PlainSegment> FindByPaper(std::span<const PlainObservation> observations);
  void FindRuns(std::span<const PlainObservation> session);
  PlainSegment* FindNearest(std::int64_t altitude_mm, bool is_strong, std::size_t stretch_begin);
  // The stretch's segments of the observation's kind.
  std::size_t CountAlike(const PlainObservation& observation, std::size_t stretch_begin) const;
  bool IsOneLayer(const PlainObservation& a, const PlainObservation& b) const;
  PlainSegment& NewSegment(const PlainObservation& observation);
  int ColumnBase(const PlainObservation& representative) const;
  void AddTo(const PlainObservation& observation, std::int64_t weight, PlainSegment& segment) const;
  struct Say {
    int units;
    bool is_vehicle;
    bool is_over_vehicle;
  };
  void Add(const Say& say, int& sum) const;
  void ReleaseOld(PlainSegment& segment) const;
  static bool SpeaksOfVehicle(const PlainObservation& observation);
  void AddColumn(const PlainObservation& observation, PlainSegment& segment) const;

  const MapProfile& profile_;
  const SigmaTable& sigmas_;
  std::vector<PlainSegment> segments_;
};

}  // namespace atlas::testing
