// Keyframe blobs: the quick check takes what decoding takes and names the same fault, and what is
// decoded is a keyframe that encodes to one that decodes to it.
#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/golden_profile.h"
#include "tests/fuzz/support/keyframe_packing.h"

namespace atlas::fuzz {
namespace {

std::vector<Bytes> Seeds() {
  return KeyframeSeeds(testing::GoldenProfile());
}

bool Run(ByteSpan blob) {
  const auto header = ReadKeyframeHeader(blob);
  const auto checked = CheckKeyframe(blob);
  const auto keyframe = DecodeKeyframe(blob);
  Require(checked.has_value() == keyframe.has_value(), "the check takes what decoding takes");
  Require(!checked || header.has_value(), "what is taken has a header");
  if (!keyframe) {
    Require(checked.error() == keyframe.error(), "the check says what decoding says");
    return false;
  }
  Require(ValidateKeyframe(*keyframe).ok(), "what is decoded is a keyframe");
  const auto again = DecodeKeyframe(EncodeKeyframe(*keyframe));
  Require(again.has_value() && *again == *keyframe, "a keyframe reads back");
  return true;
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  return MutatePacked(input, max_size, random, KeyframePacking());
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
