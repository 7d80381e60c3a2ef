// Preset bounded: of each band of altitude in a cell, only the segments that were seen last count,
// so that what a cell costs does not grow with the passes. Guesses never push out what was
// measured.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/segment/segment_view.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// The order in which a choice takes segments: strong ones first, of each kind the latest.
inline bool IsChosenBefore(const SegmentView& a, const SegmentView& b) {
  return a.segment->is_strong != b.segment->is_strong ? a.segment->is_strong : WasSeenEarlier(b, a);
}

// Reused from cell to cell.
class BoundedChoice {
 public:
  // `profile` must outlive the choice.
  explicit BoundedChoice(const MapProfile& profile) : profile_(profile) {}

  // In that order a segment counts while its band holds fewer than `band_segments`, and fewer than
  // `band_vehicle_segments` of its vehicle. Moves those that count to the front, the order kept,
  // and says how many they are.
  std::size_t MoveLatestToFront(std::span<SegmentView> segments);

 private:
  // Bands are found by their last bits, so that others may have to be told apart.
  static constexpr std::size_t kSlots = 64;
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  struct Candidate {
    std::int32_t band = 0;
    std::uint32_t index = 0;
    bool counts = false;
    std::uint32_t next = kNone;  // the one of its slot that was chosen before
  };

  static std::size_t Slot(std::int32_t band) { return static_cast<std::uint32_t>(band) % kSlots; }
  void FindCandidates(std::span<const SegmentView> segments);
  void Choose(std::span<const SegmentView> segments);
  bool HasRoom(const Candidate& candidate, std::span<const SegmentView> segments) const;
  std::size_t MoveRestBack(std::span<SegmentView> segments);

  const MapProfile& profile_;
  std::vector<std::int32_t> bands_;             // by segment
  std::array<std::uint32_t, kSlots> counts_{};  // of segments; all zero between two calls
  std::vector<Candidate> candidates_;           // as they are chosen
  std::array<std::uint32_t, kSlots> chosen_{};  // the last candidate of each slot, or kNone
  std::vector<std::uint8_t> is_dropped_;        // by segment
  std::vector<SegmentView> rest_;
};

}  // namespace atlas
