#include "tests/core/fusion/oracle/plain_survey.h"

#include <algorithm>
#include <cstdlib>

#include "core/geometry/nibble.h"
#include "core/tile/column_lattice.h"
#include "core/tile/layer_association.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kMaxSegments = 32;  // of one stretch and kind in a cell

bool SameStretch(const PlacedKeyframe& a, const PlacedKeyframe& b, const MapProfile& profile) {
  return a.key.sequence / profile.stretch_keyframes == b.key.sequence / profile.stretch_keyframes &&
         (a.key.session == b.key.session);
}

}  // namespace

bool IsStretchsLastWord(int evidence, const MapProfile& profile) {
  return evidence == -profile.driven_clamp && profile.driven_clamp > profile.stretch_clamp;
}

std::span<PlainSegment> PlainSurvey::Find(std::span<const PlainObservation> observations) {
  segments_.clear();
  std::size_t stretch_begin = 0;
  const PlacedKeyframe* previous = nullptr;
  for (const PlainObservation& observation : observations) {
    if (previous == nullptr || !SameStretch(*previous, *observation.placed, profile_)) {
      stretch_begin = segments_.size();
    }
    previous = observation.placed;
    const Nearest ground = FindNearest(observation.altitude_mm, true, stretch_begin);
    if (!observation.is_strong() && ground.segment != nullptr &&
        ground.distance_mm < profile_.other_layer_mm) {
      PlainObservation lent = observation;  // its column, not its altitude
      const std::int64_t error_mm =
          std::abs(ground.segment->representative->altitude_mm - observation.altitude_mm);
      lent.occupancy =
          error_mm <= profile_.same_layer_mm ? observation.occupancy : Occupancy::kUnknown;
      AddTo(lent, 0, *ground.segment);
      continue;
    }
    PlainSegment& segment =
        SegmentFor(observation, observation.is_strong()
                                    ? ground
                                    : FindNearest(observation.altitude_mm, false, stretch_begin));
    if (segment.representative == nullptr ||
        observation.distance_step < segment.representative->distance_step) {
      segment.representative = &observation;
    }
    AddTo(observation, sigmas_.Weight(observation.source, observation.distance_step), segment);
  }
  return segments_;
}

// Of the stretch's segments of a kind the one seen last of those as close as one layer always may
// be, else the nearest in altitude; of two equally near ones the one seen last.
PlainSurvey::Nearest PlainSurvey::FindNearest(std::int64_t altitude_mm,
                                              bool is_strong,
                                              std::size_t stretch_begin) {
  Nearest nearest;
  for (std::size_t i = stretch_begin; i < segments_.size(); ++i) {
    PlainSegment& segment = segments_[i];
    if (segment.representative->is_strong() != is_strong) {
      continue;
    }
    ++nearest.alike;
    const std::int64_t distance_mm = std::max<std::int64_t>(
        std::abs(segment.representative->altitude_mm - altitude_mm), profile_.same_layer_mm);
    if (nearest.segment == nullptr || distance_mm < nearest.distance_mm ||
        (distance_mm == nearest.distance_mm &&
         segment.last->key.sequence > nearest.segment->last->key.sequence)) {
      nearest.segment = &segment;
      nearest.distance_mm = distance_mm;
    }
  }
  return nearest;
}

bool PlainSurvey::IsOneLayer(const PlainObservation& a, const PlainObservation& b) const {
  const std::int64_t distance_mm = std::abs(std::int64_t{a.altitude_mm} - b.altitude_mm);
  return distance_mm <= profile_.same_layer_mm ||
         (distance_mm < profile_.other_layer_mm &&
          OverlapsAsOneLayer({a.altitude_mm, sigmas_.Sigma100um(a.source, a.distance_step)},
                             {b.altitude_mm, sigmas_.Sigma100um(b.source, b.distance_step)}));
}

// A new one when the nearest would be another layer.
PlainSegment& PlainSurvey::SegmentFor(const PlainObservation& observation, const Nearest& nearest) {
  if (nearest.segment != nullptr && (nearest.alike == kMaxSegments ||
                                     IsOneLayer(*nearest.segment->representative, observation))) {
    return *nearest.segment;
  }
  PlainSegment& segment = segments_.emplace_back();
  segment.first = observation.placed;
  segment.column_base = ColumnBaseIndex(observation.altitude_mm, profile_) -
                        std::clamp((16 - profile_.column_segments) / 2, 1, 4);
  return segment;
}

void PlainSurvey::AddTo(const PlainObservation& observation,
                        std::int64_t weight,
                        PlainSegment& segment) const {
  segment.last = observation.placed;
  ReleaseOld(segment);
  if (SpeaksOfVehicle(observation)) {
    segment.driven = observation.placed;
  }
  segment.weight += weight;
  segment.weighted_mm += weight * observation.altitude_mm;
  ++segment.observations;
  const int units = observation.occupancy == Occupancy::kObstacle ? profile_.hit_units
                    : observation.occupancy == Occupancy::kFree   ? profile_.miss_units
                                                                  : 0;
  Add({units, observation.occupancy == Occupancy::kDriven, false}, segment.occupancy);
  if (observation.column != 0) {
    AddColumn(observation, segment);
  }
}

// What the vehicle said of where it was itself holds for a while.
void PlainSurvey::ReleaseOld(PlainSegment& segment) const {
  if (segment.driven == nullptr ||
      segment.last->time_ms - segment.driven->time_ms <= profile_.driven_hold_ms) {
    return;
  }
  segment.driven = nullptr;
  segment.occupancy = std::max<int>(segment.occupancy, -profile_.stretch_clamp);
  for (int& evidence : segment.column) {
    evidence = std::max<int>(evidence, -profile_.stretch_clamp);
  }
}

bool PlainSurvey::SpeaksOfVehicle(const PlainObservation& observation) {
  bool speaks = observation.occupancy == Occupancy::kDriven;
  for (int nibble = 0; nibble < 16; ++nibble) {
    const std::uint8_t state = NibbleAt(observation.column, nibble);
    speaks |= state == kNibbleFree || state == kNibbleOver;
  }
  return speaks;
}

// Where the vehicle itself was is a stretch's last word; right above it misses go no deeper and
// hits add up.
void PlainSurvey::Add(const Say& say, int& sum) const {
  if (say.is_vehicle || IsStretchsLastWord(sum, profile_)) {
    sum = -profile_.driven_clamp;
  } else if (say.is_over_vehicle) {
    sum = 1 - profile_.driven_clamp;
  } else {
    const int floor = std::min<int>(sum, -profile_.stretch_clamp);
    sum = std::clamp<int>(sum + say.units, floor, profile_.stretch_clamp);
  }
}

void PlainSurvey::AddColumn(const PlainObservation& observation, PlainSegment& segment) const {
  for (int nibble = 0; nibble < profile_.column_segments; ++nibble) {
    const std::uint8_t state = NibbleAt(observation.column, nibble);
    const std::int64_t k = std::int64_t{observation.column_base} + nibble - segment.column_base;
    if (state == 0 || k < 0 || k >= 16) {
      continue;
    }
    int& sum = segment.column[static_cast<std::size_t>(k)];
    segment.is_seen[static_cast<std::size_t>(k)] = true;
    Add({kNibbleEvidence[state], state == kNibbleFree, state == kNibbleOver}, sum);
  }
}

}  // namespace atlas::testing
