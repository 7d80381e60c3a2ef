// The surveys of a tile as they are kept from one fusion of it to the next.
#pragma once

#include <cstdint>

#include "core/fusion/tile_surveys.h"

namespace atlas {

struct KeptSurveys {
  TileSurveys surveys;
  std::uint64_t revision = 0;         // of the atlas that the tile was last made from
  std::uint64_t stored_revision = 0;  // that which went to disk last or came from there, if any did
};

}  // namespace atlas
