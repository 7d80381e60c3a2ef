#include "tests/core/fusion/oracle/plain_survey.h"

#include <algorithm>
#include <cstdlib>

#include "core/geometry/nibble.h"
#include "core/tile/column_lattice.h"
#include "core/tile/layer_association.h"

namespace atlas::testing {
namespace {

constexpr std::size_t kMaxSegments = 32;  // of one stretch and kind in a cell

std::int64_t DistanceMm(const PlainSegment& segment, std::int64_t altitude_mm) {
  return std::abs(segment.representative->altitude_mm - altitude_mm);
}

}  // namespace

bool IsStretchsLastWord(int evidence, const MapProfile& profile) {
  return evidence == -profile.driven_clamp && profile.driven_clamp > profile.stretch_clamp;
}

std::span<PlainSegment> PlainSurvey::Find(std::span<const PlainObservation> observations) {
  if (profile_.preset == FusionPreset::kPaper) {
    return FindByPaper(observations);
  }
  segments_.clear();
  std::size_t stretch_begin = 0;
  std::uint32_t stretch = 0;
  for (const PlainObservation& observation : observations) {
    if (observation.stretch != stretch) {
      stretch = observation.stretch;
      stretch_begin = segments_.size();
    }
    PlainSegment* const ground = FindNearest(observation.altitude_mm, true, stretch_begin);
    const std::int64_t away_mm =
        ground == nullptr ? profile_.other_layer_mm : DistanceMm(*ground, observation.altitude_mm);
    if (!observation.is_strong() && away_mm < profile_.other_layer_mm) {
      PlainObservation lent = observation;  // its column, not its altitude
      lent.occupancy =
          away_mm <= profile_.same_layer_mm ? observation.occupancy : Occupancy::kUnknown;
      AddTo(lent, 0, *ground);
      continue;
    }
    PlainSegment* const nearest = observation.is_strong()
                                      ? ground
                                      : FindNearest(observation.altitude_mm, false, stretch_begin);
    const bool joins =
        nearest != nullptr && (IsOneLayer(*nearest->representative, observation) ||
                               CountAlike(*nearest->representative, stretch_begin) == kMaxSegments);
    PlainSegment& segment = joins ? *nearest : NewSegment(observation);
    if (segment.representative == nullptr ||
        observation.distance_step < segment.representative->distance_step) {
      segment.representative = &observation;
    }
    AddTo(observation, sigmas_.Weight(observation.source, observation.distance_step), segment);
  }
  return segments_;
}

std::span<PlainSegment> PlainSurvey::FindByPaper(std::span<const PlainObservation> observations) {
  segments_.clear();
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= observations.size(); ++i) {
    if (i == observations.size() || observations[i].stretch != observations[begin].stretch) {
      FindRuns(observations.subspan(begin, i - begin));
      begin = i;
    }
  }
  return segments_;
}

// III-C: a segment is a run of keyframes that see the cell, its representative the nearest of them.
// Eq. 2: an observation belongs to the last representative up to it or to the first after it, the
// one that is closer in altitude.
void PlainSurvey::FindRuns(std::span<const PlainObservation> session) {
  const std::size_t first = segments_.size();
  for (std::size_t i = 0; i < session.size(); ++i) {
    const bool starts =
        i == 0 || session[i].placed->key.sequence - session[i - 1].placed->key.sequence >
                      profile_.sequence_gap;
    PlainSegment& run = starts ? NewSegment(session[i]) : segments_.back();
    if (starts || session[i].distance_step < run.representative->distance_step) {
      run.representative = &session[i];
    }
  }
  for (std::size_t i = first; i < segments_.size(); ++i) {
    segments_[i].column_base = ColumnBase(*segments_[i].representative);
  }
  for (const PlainObservation& observation : session) {
    std::size_t own = first;
    for (std::size_t i = first; i < segments_.size(); ++i) {
      own = segments_[i].representative <= &observation ? i : own;
    }
    if (segments_[own].representative <= &observation && own + 1 < segments_.size() &&
        DistanceMm(segments_[own + 1], observation.altitude_mm) <
            DistanceMm(segments_[own], observation.altitude_mm)) {
      ++own;
    }
    AddTo(observation, sigmas_.Weight(observation.source, observation.distance_step),
          segments_[own]);
  }
}

// Of the stretch's segments of a kind the one seen last of those as close as one layer always may
// be, else the nearest in altitude; of two equally near ones the one seen last.
PlainSegment* PlainSurvey::FindNearest(std::int64_t altitude_mm,
                                       bool is_strong,
                                       std::size_t stretch_begin) {
  PlainSegment* nearest = nullptr;
  std::int64_t nearest_mm = 0;
  for (std::size_t i = stretch_begin; i < segments_.size(); ++i) {
    PlainSegment& segment = segments_[i];
    if (segment.representative->is_strong() != is_strong) {
      continue;
    }
    const std::int64_t distance_mm =
        std::max<std::int64_t>(DistanceMm(segment, altitude_mm), profile_.same_layer_mm);
    if (nearest == nullptr || distance_mm < nearest_mm ||
        (distance_mm == nearest_mm && segment.last->key.sequence > nearest->last->key.sequence)) {
      nearest = &segment;
      nearest_mm = distance_mm;
    }
  }
  return nearest;
}

std::size_t PlainSurvey::CountAlike(const PlainObservation& observation,
                                    std::size_t stretch_begin) const {
  return static_cast<std::size_t>(
      std::count_if(segments_.begin() + static_cast<std::ptrdiff_t>(stretch_begin), segments_.end(),
                    [&](const PlainSegment& segment) {
                      return segment.representative->is_strong() == observation.is_strong();
                    }));
}

bool PlainSurvey::IsOneLayer(const PlainObservation& a, const PlainObservation& b) const {
  const std::int64_t distance_mm = std::abs(std::int64_t{a.altitude_mm} - b.altitude_mm);
  return distance_mm <= profile_.same_layer_mm ||
         (distance_mm < profile_.other_layer_mm &&
          OverlapsAsOneLayer({a.altitude_mm, sigmas_.Sigma100um(a.source, a.distance_step)},
                             {b.altitude_mm, sigmas_.Sigma100um(b.source, b.distance_step)}));
}

PlainSegment& PlainSurvey::NewSegment(const PlainObservation& observation) {
  PlainSegment& segment = segments_.emplace_back();
  segment.first = observation.placed;
  segment.column_base = ColumnBase(observation);
  return segment;
}

int PlainSurvey::ColumnBase(const PlainObservation& representative) const {
  return ColumnBaseIndex(representative.altitude_mm, profile_) -
         std::clamp((16 - profile_.column_segments) / 2, 1, 4);
}

void PlainSurvey::AddTo(const PlainObservation& observation,
                        std::int64_t weight,
                        PlainSegment& segment) const {
  segment.last = observation.placed;
  segment.is_strong |= observation.is_strong();
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
  for (std::uint64_t column = observation.column; column != 0; column >>= 4) {
    const std::uint8_t state = NibbleAt(column, 0);
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
