// What every step of fusion needs beside its input.
#pragma once

#include "core/fusion/observation/sigma_table.h"
#include "core/geometry/map_profile.h"

namespace atlas {

struct FusionContext {
  const MapProfile& profile;
  const SigmaTable& sigmas;  // of `profile`, for the largest radius that occurs
};

}  // namespace atlas
