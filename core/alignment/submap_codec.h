// A submap's bytes, looked at without decoding them, and places of submaps as they are in them.
#pragma once

#include <vector>

#include "core/alignment/submap.h"
#include "core/base/bytes.h"

namespace atlas {

// Whether these are the bytes that Submap::Encode made of some submap: by their checksum.
bool AreSubmap(ByteSpan bytes);

void WritePlaces(const std::vector<SubmapPlace>& places, ByteWriter& out);
// None where the reader fails.
std::vector<SubmapPlace> ReadPlaces(ByteReader& in);

}  // namespace atlas
