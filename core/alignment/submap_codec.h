// Places of submaps as bytes, as they are in a submap's own (Submap::Encode).
#pragma once

#include <vector>

#include "core/alignment/submap.h"
#include "core/base/bytes.h"

namespace atlas {

void WritePlaces(const std::vector<SubmapPlace>& places, ByteWriter& out);
// None where the reader fails.
std::vector<SubmapPlace> ReadPlaces(ByteReader& in);

}  // namespace atlas
