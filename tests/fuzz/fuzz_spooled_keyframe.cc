// Keyframes that wait on a vehicle's disk.
#include "client/vehicle/spooled_keyframe.h"
#include "tests/core/support/golden_profile.h"
#include "tests/fuzz/support/keyframe_packing.h"

namespace atlas::fuzz {
namespace {

constexpr std::size_t kHashBytes = 8;

std::vector<Bytes> Seeds() {
  std::vector<Bytes> seeds;
  for (const Bytes& blob : KeyframeSeeds(testing::GoldenProfile())) {
    seeds.push_back(EncodeSpooled({{{"bus", "day-2"}, 7}, 1'700'000'000'000, {}, blob}));
    seeds.push_back(EncodeSpooled({{{"bus", "day-2"}, 8}, 1'700'000'000'000, {}, blob, true}));
    seeds.push_back(EncodeSpooled({{{"bus", "day-2"}, 9},
                                   1'700'000'000'000,
                                   {},
                                   blob,
                                   true,
                                   KnownPosition{-1'000'000, 2, 1LL << 40, 500}}));
  }
  seeds.push_back(EncodeSpooled({{{"b", "d"}, 0}, 0, {}, {}}));
  return seeds;
}

bool Run(ByteSpan file) {
  const auto keyframe = DecodeSpooled(file);
  if (!keyframe) {
    return false;
  }
  Require(keyframe->key.Validate().ok(), "a spooled keyframe has a name");
  const auto again = DecodeSpooled(EncodeSpooled(keyframe->ToUpload()));
  Require(again && again->key == keyframe->key && again->blob == keyframe->blob &&
              again->prior == keyframe->prior,
          "it reads back");
  return true;
}

std::optional<Bytes> Unpack(ByteSpan file) {
  if (file.size() < kHashBytes) {
    return std::nullopt;
  }
  const ByteSpan content = file.first(file.size() - kHashBytes);
  return Bytes(content.begin(), content.end());
}

Bytes Pack(ByteSpan content) {
  Bytes file(content.begin(), content.end());
  file.resize(file.size() + kHashBytes);
  SealAtEnd(file);
  return file;
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  return MutatePacked(input, max_size, random, {&Unpack, &Pack, &SealAtEnd});
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
