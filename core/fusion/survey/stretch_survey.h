// What one stretch of a session saw of a band of a tile: the segments of its cells.
//
// A stretch is the keyframes of one session whose sequence numbers agree but for their last bits
// (`stretch_keyframes`). Its survey depends on its keyframes and their poses alone, whatever the
// other sessions say: a change of one stretch leaves the others' surveys as they are, and a
// keyframe that follows the last one is simply added.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/base/bytes.h"
#include "core/fusion/observation/frame_resampler.h"
#include "core/fusion/observation/observation.h"
#include "core/fusion/observation/sigma_table.h"
#include "core/fusion/segment/column_evidence.h"
#include "core/fusion/segment/segment.h"
#include "core/fusion/survey/cell_set.h"

namespace atlas {

// The keyframes of a stretch in the order they were taken.
struct StretchFrame {
  std::uint32_t sequence = 0;
  std::int64_t time_ms = 0;
};

class StretchSurvey {
 public:
  // A cell has no more segments of a kind and stretch: a bound on what hostile vehicles can make of
  // it.
  static constexpr std::uint32_t kMaxCellSegments = 32;

  StretchSurvey(const TileBand& band, const MapProfile& profile);
  // Of a PackedCopy() and the frames that it had: Unpack() comes before anything else.
  StretchSurvey(const TileBand& band,
                const MapProfile& profile,
                std::vector<StretchFrame> frames,
                Bytes packed);

  // Adds a keyframe's observations. Sequence numbers must rise from call to call.
  void Add(const FrameOnMap& frame, const Keyframe& keyframe, const SigmaTable& sigmas);

  // The same by hand: frames, then segments and the observations that belong to them.
  void AddFrame(const StretchFrame& frame) { frames_.push_back(frame); }
  std::uint32_t AddSegment(std::size_t cell, const Observation& representative, bool is_strong);
  // As it is, before the cell's others.
  std::uint32_t AddSegment(std::size_t cell, const Segment& segment);
  void AddEvidence(const Observation& observation,
                   std::int64_t weight,
                   std::uint32_t frame,
                   std::uint32_t segment) {
    AddEvidence(observation, observation.occupancy, weight, frame, segment);
  }

  const TileBand& band() const { return band_; }
  std::span<const StretchFrame> frames() const { return frames_; }
  std::size_t bytes() const;
  std::size_t size() const { return segments_.size(); }  // of all cells

  // Compresses the segments; they come back, as not used, with Unpack(), which comes before
  // anything else. What did not change since it was packed last is not compressed again.
  void Pack();
  void Unpack();
  // What Pack() would keep, for a survey of the same build.
  Bytes PackedCopy() const;

  // First segment of a cell, the next by Segment::next, or Segment::kNone. Cells row by row.
  std::uint32_t First(std::size_t cell) const { return heads_[cell]; }
  Segment& At(std::uint32_t segment) { return segments_[segment]; }

  // Cells that were observed since these were cleared last. The segments that changed are revised.
  const CellSet& touched() const { return touched_; }
  void ClearTouched() { touched_.Clear(); }
  // The altitude of a segment when it was combined last, or when it was made.
  std::int32_t CombinedAltitude(std::uint32_t segment) const { return combined_mm_[segment]; }
  // A revised segment of this survey was combined.
  void SetCombined(Segment& segment) {
    segment.is_revised = false;
    combined_mm_[static_cast<std::size_t>(&segment - segments_.data())] = segment.altitude_mm;
  }
  // Inserts the cells that have segments.
  void FindCells(CellSet& cells) const;

 private:
  // One of a cell's segments of a kind.
  struct Match {
    std::uint32_t segment = Segment::kNone;
    std::uint32_t before = Segment::kNone;  // whose next it is, if not the cell's first
    std::uint32_t alike = 0;                // segments of the kind that were looked at
    std::int64_t distance_mm = std::numeric_limits<std::int64_t>::max();
  };

  void Join(std::size_t cell, const Observation& observation, const SigmaTable& sigmas);
  void AddEvidence(const Observation& observation,
                   Occupancy occupancy,
                   std::int64_t weight,
                   std::uint32_t frame,
                   std::uint32_t index);
  // Forgets that the vehicle was there, once it was long ago when `frame` was taken.
  void ReleaseOld(std::uint32_t frame, Segment& segment) const;
  std::int8_t AddOccupancy(int evidence, Occupancy occupancy) const;
  bool IsOneLayer(const Observation& observation,
                  const Match& match,
                  const SigmaTable& sigmas) const;
  Match Find(std::size_t cell, std::int32_t altitude_mm, bool is_strong) const;
  void MoveToFront(std::size_t cell, const Match& match);

  MapProfile profile_;
  TileBand band_;
  EvidenceClamp clamp_;
  std::array<std::int16_t, 3> occupancy_units_;  // by Occupancy, but kDriven
  std::vector<StretchFrame> frames_;
  std::vector<std::uint32_t> heads_;  // by cell of the band
  std::vector<Segment> segments_;
  std::vector<std::int32_t> combined_mm_;  // of each
  CellSet touched_;
  Bytes packed_;  // heads_ and segments_, if not empty
};

}  // namespace atlas
