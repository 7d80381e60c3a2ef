// The map that a vehicle holds, as its localizer asks for it: with a link or without one.
#pragma once

#include <functional>

#include <Eigen/Core>

#include "client/vehicle/atlas_view.h"
#include "core/geometry/map_profile.h"
#include "core/localization/localizer.h"
#include "core/localization/relocalizer.h"
#include "core/localization/window/local_map.h"

namespace atlas {

// May be empty. Told of each map that was asked for: what it lacks, and why it is not current.
using OnMap = std::function<void(const MapAround&)>;

// What a localizer takes (core/localization/localizer.h): each call, one in half of
// LocalMapOptions::margin_m of the way, is one of `view.Around`; the deadline of `options` is how
// long a scan may wait for tiles. Where finer tiles are not held coarser ones stand in: scans that
// they match are weak at best (MapCover), and the map is asked for again soon. Without a link
// it is what is held. Fails for options that make no sense (kInvalidArgument). `view` outlives it.
TilesAround TilesOf(AtlasView& view, const AroundOptions& options, OnMap on_map = {});

// Where a vehicle that is lost is looked for: in `radius_m` around where it was last, which
// `last_place` tells, as far as the finest tiles there are held or come within `options`. Made when
// it is first needed, and again when one of them came, changed or went, or that is elsewhere by
// half the radius. No relocalizer where no such tile is held. Fails as TilesOf(). `view` outlives
// it.
RelocalizerSource RelocalizerOf(AtlasView& view,
                                const MapProfile& profile,
                                std::function<Eigen::Vector2d()> last_place,
                                double radius_m,
                                const AroundOptions& options,
                                const RelocalizerOptions& relocalizer = {});

}  // namespace atlas
