// Preset bounded: which segments may be forgotten, and whether what was forgotten may count again,
// without asking its keyframes.
//
// In its band a segment cannot count while as many of its vehicle as a vehicle may have come before
// it (IsChosenBefore), or as many of all vehicles as the band may hold. So it is enough to know, of
// all that were forgotten in a band of a cell, which would come first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/segment/forgotten_mark.h"
#include "core/fusion/segment/segment_view.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// Reused from cell to cell.
class Forgetting {
 public:
  // `profile` must outlive this.
  explicit Forgetting(const MapProfile& profile) : profile_(profile) {}

  // Of a cell, `counting` are the segments that count, `rest` the others, `marks` what was
  // forgotten before. Moves those of `rest` to the front that must not be forgotten, and says how
  // many they are: what is forgotten cannot count even without any three stretches of the others.
  // Adds it to `marks`; of a band a handful stay at most.
  std::size_t MoveSpareToFront(std::span<const SegmentView> counting,
                               std::span<SegmentView> rest,
                               std::vector<ForgottenMark>& marks);

  // Whether something that `marks` of a cell stand for may count beside `present`.
  bool MayCount(std::span<const ForgottenMark> marks, std::span<const SegmentView> present);

 private:
  // How many segments of a stretch come before a mark in its band.
  struct Tally {
    std::uint32_t stretch = 0;
    std::uint32_t vehicle = 0;
    std::size_t segments = 0;
  };

  // One that is there, as a mark.
  struct Present {
    ForgottenMark mark;
    std::uint32_t stretch = 0;
  };

  void SetPresent(std::span<const SegmentView> segments);
  void AddPresent(const SegmentView& view);
  void TallyBefore(const ForgottenMark& mark);
  // Whether those keep the mark out, even without any `spare` stretches of them.
  bool IsVehicleFull(std::uint32_t vehicle, std::size_t spare) const;
  bool IsBandFull(std::size_t spare) const;

  const MapProfile& profile_;
  std::vector<Present> present_;
  std::vector<ForgottenMark> before_;
  std::vector<Tally> tallies_;  // the largest first
};

}  // namespace atlas
