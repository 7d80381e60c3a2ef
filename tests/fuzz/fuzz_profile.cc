// Map profiles: what decodes is valid and has these bytes alone.
#include <algorithm>

#include "core/geometry/map_profile.h"
#include "tests/core/support/golden_profile.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

std::vector<Bytes> Seeds() {
  return {MapProfile().Encode(), testing::GoldenProfile().Encode()};
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
