#include "core/fusion/survey/stretch_survey.h"

#include <algorithm>
#include <cassert>
#include <cstdlib>
#include <limits>
#include <utility>

#include "core/fusion/survey/packed_arrays.h"
#include "core/tile/column_lattice.h"
#include "core/tile/layer_association.h"

namespace atlas {
namespace {

void SetRepresentative(const Observation& observation, Segment& segment) {
  segment.altitude_mm = observation.altitude_mm;
  segment.distance_step = observation.distance_step;
  segment.source = observation.source;
}

}  // namespace

StretchSurvey::StretchSurvey(const TileBand& band, const MapProfile& profile)
    : profile_(profile),
      band_(band),
      clamp_{static_cast<std::int8_t>(profile.stretch_clamp),
             static_cast<std::int8_t>(profile.driven_clamp)},
      occupancy_units_{0, profile.miss_units, profile.hit_units},
      heads_(static_cast<std::size_t>(band.rows) * profile.tile_cells, Segment::kNone),
      touched_(heads_.size()) {}

StretchSurvey::StretchSurvey(const TileBand& band,
                             const MapProfile& profile,
                             std::vector<StretchFrame> frames,
                             Bytes packed)
    : StretchSurvey(band, profile) {
  frames_ = std::move(frames);
  packed_ = std::move(packed);
}

std::size_t StretchSurvey::bytes() const {
  return sizeof(*this) + frames_.capacity() * sizeof(StretchFrame) +
         heads_.capacity() * sizeof(std::uint32_t) + segments_.capacity() * sizeof(Segment) +
         combined_mm_.capacity() * sizeof(std::int32_t) + packed_.capacity();
}

void StretchSurvey::FindCells(CellSet& cells) const {
  for (std::size_t cell = 0; cell < heads_.size(); ++cell) {
    if (heads_[cell] != Segment::kNone) {
      cells.Insert(cell);
    }
  }
}

Bytes StretchSurvey::PackedCopy() const {
  return packed_.empty() ? PackArrays(heads_, segments_) : packed_;
}

void StretchSurvey::Pack() {
  if (packed_.empty()) {
    packed_ = PackedCopy();
  }
  heads_ = std::vector<std::uint32_t>();
  segments_ = std::vector<Segment>();
  combined_mm_ = std::vector<std::int32_t>();
}

void StretchSurvey::Unpack() {
  UnpackArrays(packed_, heads_, segments_);
  combined_mm_.clear();
  for (Segment& segment : segments_) {
    segment.is_used = false;
    combined_mm_.push_back(segment.altitude_mm);
  }
}

void StretchSurvey::Add(const FrameOnMap& frame,
                        const Keyframe& keyframe,
                        const SigmaTable& sigmas) {
  assert(frames_.empty() || frames_.back().sequence < frame.key.sequence);
  AddFrame({frame.key.sequence, frame.time_ms});
  packed_ = Bytes();
  const FrameResampler resampler(frame, keyframe, sigmas, profile_);
  const auto expect = [this](std::size_t cell) {
    if (heads_[cell] != Segment::kNone) {
      __builtin_prefetch(&segments_[heads_[cell]], 1);
    }
  };
  resampler.Visit(band_, expect, [&](std::size_t cell, const Observation& observation) {
    touched_.Insert(cell);
    Join(cell, observation, sigmas);
  });
}

// An observation belongs to the segment that was seen last of those as close as one layer always
// may be, else to the nearest in altitude (the paper's eq. 2), if the two would be one layer. What
// was guessed says nothing of the altitude where ground was measured, but lends it its column, and
// its occupancy if the guess was right: what stands in the way 1 m higher does not here.
void StretchSurvey::Join(std::size_t cell,
                         const Observation& observation,
                         const SigmaTable& sigmas) {
  const auto frame = static_cast<std::uint32_t>(frames_.size() - 1);
  if (!observation.is_strong()) {
    const Match ground = Find(cell, observation.altitude_mm, true);
    if (ground.distance_mm < profile_.other_layer_mm) {
      MoveToFront(cell, ground);
      const bool is_right = ground.distance_mm <= profile_.same_layer_mm;
      AddEvidence(observation, is_right ? observation.occupancy : Occupancy::kUnknown, 0, frame,
                  ground.segment);
      return;
    }
  }
  const Match match = Find(cell, observation.altitude_mm, observation.is_strong());
  if (!IsOneLayer(observation, match, sigmas) && match.alike < kMaxCellSegments) {
    AddSegment(cell, observation, observation.is_strong());
  } else {
    MoveToFront(cell, match);
    if (observation.distance_step < segments_[match.segment].distance_step) {
      SetRepresentative(observation, segments_[match.segment]);  // of two equally near the first
    }
  }
  AddEvidence(observation, sigmas.Weight(observation.source, observation.distance_step), frame,
              heads_[cell]);
}

// Eq. 1 and the gates.
bool StretchSurvey::IsOneLayer(const Observation& observation,
                               const Match& match,
                               const SigmaTable& sigmas) const {
  if (match.distance_mm <= profile_.same_layer_mm) {
    return true;
  }
  if (match.distance_mm >= profile_.other_layer_mm) {
    return false;
  }
  const Segment& segment = segments_[match.segment];
  return OverlapsAsOneLayer(
      {segment.altitude_mm, sigmas.Sigma100um(segment.source, segment.distance_step)},
      {observation.altitude_mm, sigmas.Sigma100um(observation.source, observation.distance_step)});
}

// A cell's segments stand in the order in which they were seen last: several decks cost little more
// than one.
StretchSurvey::Match StretchSurvey::Find(std::size_t cell,
                                         std::int32_t altitude_mm,
                                         bool is_strong) const {
  Match nearest;
  std::uint32_t before = Segment::kNone;
  for (std::uint32_t i = heads_[cell]; i != Segment::kNone; before = i, i = segments_[i].next) {
    const Segment& segment = segments_[i];
    if (segment.is_strong != is_strong) {
      continue;
    }
    const std::int64_t distance_mm = std::abs(std::int64_t{segment.altitude_mm} - altitude_mm);
    ++nearest.alike;
    if (distance_mm < nearest.distance_mm) {
      nearest.segment = i;
      nearest.distance_mm = distance_mm;
      nearest.before = before;
    }
    if (distance_mm <= profile_.same_layer_mm) {
      break;
    }
  }
  return nearest;
}

void StretchSurvey::MoveToFront(std::size_t cell, const Match& match) {
  if (match.before != Segment::kNone) {
    segments_[match.before].next = segments_[match.segment].next;
    segments_[match.segment].next = heads_[cell];
    heads_[cell] = match.segment;
  }
}

std::uint32_t StretchSurvey::AddSegment(std::size_t cell,
                                        const Observation& representative,
                                        bool is_strong) {
  Segment segment;
  segment.reference_mm = representative.altitude_mm;
  SetRepresentative(representative, segment);
  segment.is_strong = is_strong;
  segment.column_base = ColumnBaseIndex(representative.altitude_mm, profile_) -
                        ColumnMargin(profile_.column_segments);
  return AddSegment(cell, segment);
}

std::uint32_t StretchSurvey::AddSegment(std::size_t cell, const Segment& segment) {
  const auto index = static_cast<std::uint32_t>(segments_.size());
  segments_.push_back(segment);
  combined_mm_.push_back(segment.altitude_mm);
  segments_.back().next = heads_[cell];
  heads_[cell] = index;
  return index;
}

void StretchSurvey::ReleaseOld(std::uint32_t frame, Segment& segment) const {
  const std::int64_t ago_ms = frames_[frame].time_ms - frames_[segment.driven_frame].time_ms;
  if (ago_ms > profile_.driven_hold_ms) {
    segment.driven_frame = Segment::kNone;
    segment.occupancy = static_cast<std::int8_t>(std::max<int>(segment.occupancy, -clamp_.usual));
    ReleaseDriven(clamp_, segment.column);
  }
}

// As columns: where the vehicle stood nothing else is until that is released.
std::int8_t StretchSurvey::AddOccupancy(int evidence, Occupancy occupancy) const {
  if (occupancy == Occupancy::kDriven) {
    return static_cast<std::int8_t>(-clamp_.driven);
  }
  const int added = occupancy_units_[static_cast<std::size_t>(occupancy)];
  const int sum = std::clamp<int>(evidence + added, -clamp_.usual, clamp_.usual);
  return static_cast<std::int8_t>(evidence < -clamp_.usual ? evidence : sum);
}

void StretchSurvey::AddEvidence(const Observation& observation,
                                Occupancy occupancy,
                                std::int64_t weight,
                                std::uint32_t frame,
                                std::uint32_t index) {
  Segment& segment = segments_[index];
  segment.is_revised = true;
  segment.weight += weight;
  segment.moment += weight * (observation.altitude_mm - segment.reference_mm);
  if (segment.observations < std::numeric_limits<std::uint16_t>::max()) {
    ++segment.observations;
  }
  segment.last_frame = frame;
  segment.is_strong = segment.is_strong || observation.is_strong();
  if (segment.driven_frame != Segment::kNone) {
    ReleaseOld(frame, segment);
  }
  if (occupancy == Occupancy::kDriven || SpeakOfVehicle(observation.column)) {
    segment.driven_frame = frame;
  }
  segment.occupancy = AddOccupancy(segment.occupancy, occupancy);
  if (observation.column != 0) {
    AddNibbles(observation.column, std::int64_t{observation.column_base} - segment.column_base,
               clamp_, segment.column, segment.column_seen);
  }
}

}  // namespace atlas
