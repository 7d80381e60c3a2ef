// What a merge keeps in its folder: records of its log, and submaps. The first byte says which.
#include "client/merge/memory/work_record.h"
#include "tests/core/support/golden_profile.h"
#include "tests/core/support/keyframe_worlds.h"
#include "tests/fuzz/support/packed_mutator.h"

namespace atlas::fuzz {
namespace {

MapProfile Profile() {
  return testing::GoldenProfile();
}

Pose At(double x_m) {
  Pose pose = Pose::Identity();
  pose.translation().x() = x_m;
  return pose;
}

Submap TwoKeyframes() {
  const MapProfile profile = Profile();
  std::vector<SubmapMember> members;
  for (std::uint32_t i = 0; i < 2; ++i) {
    members.push_back({{{"car", "day"}, i},
                       100 * i,
                       At(i),
                       std::make_shared<const Keyframe>(testing::RandomKeyframe(profile, 4, i))});
  }
  auto submap = Submap::Fuse(members, 7, profile, {});
  Require(submap.has_value(), "keyframes that stand upright are fused");
  return *std::move(submap);
}

Bytes Tagged(char kind, ByteSpan bytes) {
  ByteWriter out;
  out.U8(static_cast<std::uint8_t>(kind));
  out.Raw(bytes);
  return out.Take();
}

std::vector<Bytes> Seeds() {
  const SubmapName a{1, 2};
  const SubmapName b{3, 4};
  const Submap submap = TwoKeyframes();
  const std::vector<WorkRecord> records{
      SubmapRecord{a, {At(0.0), At(1.0)}, submap.places()},
      MatchRecord{a, b, At(0.5), {}},
      SearchRecord{1, 3, At(0.5), {4.0, 4.0, 0.1}, std::nullopt},
      SearchRecord{1, 3, At(0.5), {4.0, 4.0, 0.1}, At(0.75)},
      CutRecord{5, {{0, 4, false}, {4, 9, true}}},
      PairRecord{5, 6},
  };
  std::vector<Bytes> seeds;
  for (const WorkRecord& record : records) seeds.push_back(Tagged('r', EncodeRecord(record)));
  seeds.push_back(Tagged('s', submap.Encode()));
  return seeds;
}

bool ReadRecord(ByteSpan bytes) {
  const auto record = DecodeRecord(bytes);
  if (!record) return false;
  const Bytes again = EncodeRecord(*record);
  Require(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()),
          "a record has one encoding");
  return true;
}

bool ReadSubmap(ByteSpan bytes) {
  const auto submap = Submap::Decode(bytes);
  if (!submap) return false;
  const Bytes again = submap->Encode();
  Require(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()),
          "a submap has one encoding");
  return submap->DecodeTiles(Profile()).has_value();
}

bool Run(ByteSpan input) {
  if (input.empty()) return false;
  return input[0] == 's' ? ReadSubmap(input.subspan(1)) : ReadRecord(input.subspan(1));
}

Bytes Mutate(ByteSpan input, std::size_t max_size, Random& random) {
  Bytes mutated = MutatePlain(input, max_size, random);
  if (mutated.empty() || mutated[0] != 's' || OneIn(8, random)) return mutated;
  Bytes submap(mutated.begin() + 1, mutated.end());
  SealAtEnd(submap);
  return Tagged('s', submap);
}

}  // namespace

const Target kTarget{&Seeds, &Run, &Mutate};

}  // namespace atlas::fuzz
