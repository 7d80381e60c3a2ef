// Preset bounded: how long what was forgotten stays without say.
//
// A forgotten segment cannot count while enough that come before it (IsChosenBefore) are
// there: as many of its vehicle in its band as a vehicle may have, or of all vehicles as the band
// may hold. These are its guards, and they know that they guard something, not what: enough to see
// that none of it comes back when some of them go.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/fusion/segment/segment_view.h"
#include "core/geometry/map_profile.h"

namespace atlas {

// `kept` of a cell count while `forgotten` are there, too: makes them the guards of these and of
// what these guarded.
void MarkGuards(std::span<const SegmentView> kept,
                std::span<const SegmentView> forgotten,
                const MapProfile& profile);

// Whether what was forgotten in a cell may count once `removed` are gone and `left` stay.
bool MayCountAgain(std::span<const SegmentView> removed,
                   std::span<const SegmentView> left,
                   const MapProfile& profile);

// Moves of `forgotten` those to the front that are worth keeping, the `spare` first of each band
// and vehicle, and says how many they are.
std::size_t MoveSpareToFront(std::span<SegmentView> forgotten,
                             std::size_t spare,
                             const MapProfile& profile);

}  // namespace atlas
