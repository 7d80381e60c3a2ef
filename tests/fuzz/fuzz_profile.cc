// Map profiles: what decodes is valid and has these bytes alone.
#include <algorithm>

#include "core/geometry/map_profile.h"
#include "tests/core/support/golden_profile.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

// As version 2 had it: without the four bytes before the origin.
Bytes InVersion2(const MapProfile& profile) {
  Bytes bytes = profile.Encode();
  const std::ptrdiff_t origin_bytes = profile.origin ? 25 : 1;
  bytes.erase(bytes.end() - origin_bytes - 4, bytes.end() - origin_bytes);
  bytes[0] = 2;
  return bytes;
}

std::vector<Bytes> Seeds() {
  return {MapProfile().Encode(), testing::GoldenProfile().Encode(), InVersion2(MapProfile()),
          InVersion2(testing::GoldenProfile())};
}

bool Run(ByteSpan bytes) {
  const auto profile = MapProfile::Decode(bytes);
  if (!profile) {
    return false;
  }
  Require(profile->Validate().ok(), "what decodes is a profile");
  Require(std::ranges::equal(profile->Encode(), bytes), "a profile has one encoding");
  return true;
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
