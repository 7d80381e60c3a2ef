// Promises 1 and 3 over the whole daemon but its network: whatever happens to an atlas, and in
// whatever order, its digest is the one that the oracle makes of the keyframes and poses that
// count.
//
// ATLAS_PROPERTY_CASES: how many seeds, 600 times ATLAS_TEST_SCALE without it.
// ATLAS_PROPERTY_SEED: only that one, a few times over, because threads do not run twice the same
// way.
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "tests/core/support/memory_folder.h"
#include "tests/core/support/test_scale.h"
#include "tests/server/service/property/atlas_player.h"
#include "tests/server/service/property/random_atlas.h"
#include "tests/server/service/property/rising_atlas.h"

namespace atlas::testing {
namespace {

constexpr std::uint32_t kShards = 8;  // tests, for as many processes
constexpr std::uint32_t kUsualCases = 600;
constexpr int kRepeats = 20;  // of a single case

std::optional<std::uint32_t> NumberFrom(const char* variable) {
  const char* text = std::getenv(variable);
  return text == nullptr || *text == '\0'
             ? std::nullopt
             : std::optional(static_cast<std::uint32_t>(std::strtoul(text, nullptr, 10)));
}

void PlayCase(std::uint32_t seed, PlayCounts& counts) {
  const AtlasScript script =
      seed % 16 == 15 - seed / 16 % 16 ? RisingAtlas(seed) : RandomAtlas(seed);
  const std::string failure = AtlasPlayer(script, NewMemoryFolder("atlas_property"), counts).Play();
  ASSERT_EQ(failure, "") << "seed " << seed << " (again: ATLAS_PROPERTY_SEED=" << seed << ")\n"
                         << script;
}

class AtlasPropertyTest : public ::testing::TestWithParam<std::uint32_t> {};

TEST_P(AtlasPropertyTest, TheDigestIsTheOraclesWhateverHappened) {
  const auto begin = std::chrono::steady_clock::now();
  PlayCounts counts;
  if (const auto seed = NumberFrom("ATLAS_PROPERTY_SEED")) {
    for (int i = 0; i < kRepeats && *seed % kShards == GetParam() && !HasFailure(); ++i) {
      PlayCase(*seed, counts);
    }
    return;
  }
  const std::uint32_t cases = NumberFrom("ATLAS_PROPERTY_CASES").value_or(Scaled(kUsualCases));
  for (std::uint32_t seed = GetParam(); seed < cases && !HasFailure(); seed += kShards) {
    PlayCase(seed, counts);
  }
  const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
  // deploy/test.sh adds these lines up.
  std::cout << "property: " << counts.cases << " cases, " << counts.steps << " steps, "
            << counts.reopened << " restarts, " << counts.refused << " refusals, "
            << counts.compared << " digests of " << counts.tiles << " tiles, "
            << counts.compared_past << " of the past, " << counts.dropped
            << " keyframes dropped in " << counts.compacted << " compactions, " << time.count()
            << " s" << std::endl;
  RecordProperty("cases", std::to_string(counts.cases));
}

INSTANTIATE_TEST_SUITE_P(Shards, AtlasPropertyTest, ::testing::Range(0u, kShards));

}  // namespace
}  // namespace atlas::testing
