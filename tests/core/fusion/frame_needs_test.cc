// Which keyframes a tile is still made of, in worlds small enough to tell by hand, and in random
// ones: the others may go.
#include "core/fusion/frame_needs.h"

#include <algorithm>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/fusion/deck_world.h"
#include "tests/core/fusion/random_drives.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

using testing::Deck;
using testing::FrameName;
using testing::See;

using Indices = std::vector<std::size_t>;

constexpr std::size_t kMuch = std::size_t{128} << 20;
const Deck kStreet{0.5};  // in the middle of a band of altitude

// A pass is one keyframe; later ones have higher numbers.
FrameName Pass(std::uint32_t number, const std::string& vehicle = "car") {
  return {vehicle, "pass" + std::to_string(number), 1'000 * number};
}

MapProfile Bounded() {
  MapProfile profile = testing::SmallProfile();
  profile.preset = FusionPreset::kBounded;
  return profile;
}

class Needs {
 public:
  Needs(std::vector<PlacedKeyframe> keyframes, const MapProfile& profile)
      : keyframes_(std::move(keyframes)), profile_(profile) {}

  Indices Of(const std::function<bool(std::size_t)>& is_asked, std::size_t max_bytes = kMuch) {
    std::vector<FrameOnMap> frames;
    for (const PlacedKeyframe& k : keyframes_) {
      frames.push_back({k.key, k.time_ms, k.placement, k.keyframe->grid});
    }
    const auto source = [this](std::size_t i) -> Result<std::shared_ptr<const Keyframe>> {
      ++reads_;
      return keyframes_[i].keyframe;
    };
    return FindNeededFrames({0, 0, 0}, frames, is_asked, source, profile_, max_bytes).value();
  }
  Indices OfAll(std::size_t max_bytes = kMuch) {
    return Of([](std::size_t) { return true; }, max_bytes);
  }
  std::size_t reads() const { return reads_; }

 private:
  std::vector<PlacedKeyframe> keyframes_;
  MapProfile profile_;
  std::size_t reads_ = 0;
};

Indices NeededOf(std::vector<PlacedKeyframe> keyframes) {
  return Needs(std::move(keyframes), Bounded()).OfAll();
}

TEST(FrameNeedsTest, OfOneVehicleTheLastThreePassesAreNeeded) {
  std::vector<PlacedKeyframe> passes;
  for (std::uint32_t i = 0; i < 5; ++i) {
    passes.push_back(See(kStreet, Pass(i)));
    const std::size_t oldest = passes.size() > 3 ? passes.size() - 3 : 0;
    Indices last;
    for (std::size_t k = oldest; k < passes.size(); ++k) {
      last.push_back(k);
    }
    EXPECT_EQ(NeededOf(passes), last);
  }
}

TEST(FrameNeedsTest, OfManyVehiclesTheLastEightAreNeeded) {
  std::vector<PlacedKeyframe> passes;
  for (std::uint32_t i = 0; i < 10; ++i) {
    passes.push_back(See(kStreet, Pass(i, "car" + std::to_string(i))));
  }
  EXPECT_EQ(NeededOf(passes), (Indices{2, 3, 4, 5, 6, 7, 8, 9}));
}

TEST(FrameNeedsTest, WhatSawOneCellMoreIsNeeded) {
  Deck small = kStreet;
  small.radius_cells = 6;
  Deck smaller = small;
  smaller.radius_cells = 5;
  EXPECT_EQ(NeededOf({See(small, Pass(0)), See(smaller, Pass(1)), See(smaller, Pass(2)),
                      See(smaller, Pass(3))}),
            (Indices{0, 1, 2, 3}));
  EXPECT_EQ(NeededOf({See(smaller, Pass(0)), See(small, Pass(1)), See(small, Pass(2)),
                      See(small, Pass(3))}),
            (Indices{1, 2, 3}));
}

TEST(FrameNeedsTest, WhatSawAnotherDeckIsNeeded) {
  Deck above = kStreet;
  above.z_m = 4.5;
  EXPECT_EQ(NeededOf({See(above, Pass(0)), See(kStreet, Pass(1)), See(kStreet, Pass(2)),
                      See(kStreet, Pass(3)), See(kStreet, Pass(4))}),
            (Indices{0, 2, 3, 4}));
}

TEST(FrameNeedsTest, LaterGuessesDoNotMakeAMeasurementUnneeded) {
  Deck guess = kStreet;
  guess.source = AltitudeSource::kExtrapolated;
  EXPECT_EQ(NeededOf({See(kStreet, Pass(0)), See(guess, Pass(1)), See(guess, Pass(2)),
                      See(guess, Pass(3)), See(guess, Pass(4))}),
            (Indices{0, 3, 4}));
}

TEST(FrameNeedsTest, OfAStretchOnlySomeMayBeNeeded) {
  Deck left = kStreet;
  left.x_m = 0.3;
  left.radius_cells = 3;
  Deck right = left;
  right.x_m = 1.3;
  EXPECT_EQ(NeededOf({See(left, {"car", "first", 0}), See(right, {"car", "first", 1}),
                      See(right, Pass(1)), See(right, Pass(2)), See(right, Pass(3))}),
            (Indices{0, 2, 3, 4}));
}

TEST(FrameNeedsTest, WhatSpokeToASegmentThatCountsIsNeededWhateverItSaid) {
  Deck free_sight = kStreet;
  free_sight.occupancy = Occupancy::kUnknown;
  free_sight.source = AltitudeSource::kExtrapolated;  // lends nothing but that it was there
  EXPECT_EQ(NeededOf({See(kStreet, {"car", "first", 0}), See(free_sight, {"car", "first", 1})}),
            (Indices{0, 1}));
}

TEST(FrameNeedsTest, WhatSeesNothingOfTheTileIsNotNeeded) {
  Deck far = kStreet;
  far.x_m = 100.0;
  Keyframe blank = testing::BlankKeyframe(Bounded(), 16);
  EXPECT_EQ(NeededOf({See(far, Pass(0)), See(kStreet, Pass(1)),
                      testing::PlacedFrame(Pass(2), {0.8, 0.8, 2.5}, std::move(blank))}),
            (Indices{1}));
  EXPECT_EQ(NeededOf({}), Indices{});
}

TEST(FrameNeedsTest, OnlyThoseAskedForAreTold) {
  std::vector<PlacedKeyframe> passes;
  for (std::uint32_t i = 0; i < 5; ++i) {
    passes.push_back(See(kStreet, Pass(i)));
  }
  Needs needs(passes, Bounded());
  EXPECT_EQ(needs.Of([](std::size_t) { return false; }), Indices{});
  EXPECT_EQ(needs.reads(), 0u);
  EXPECT_EQ(needs.Of([](std::size_t i) { return i == 1 || i == 3; }), (Indices{3}));
  EXPECT_EQ(needs.reads(), 7u);  // each once, and the two again
}

TEST(FrameNeedsTest, ErrorsAreTheSources) {
  const std::vector<FrameOnMap> frames{{{{"car", "a"}, 1}, 0, testing::PlaceAt({}), {100'000, 9}}};
  const Status gone(StatusCode::kUnavailable, "gone");
  const auto source = [&](std::size_t) -> Result<std::shared_ptr<const Keyframe>> {
    return Error(gone);
  };
  const auto needed = FindNeededFrames(
      {0, 0, 0}, frames, [](std::size_t) { return true; }, source, Bounded());
  EXPECT_EQ(needed.error(), gone);
}

// With a stretch for each keyframe nothing joins what went: the tile stays as it is to the byte.
TEST(FrameNeedsTest, WithoutTheOthersTheTileIsTheSame) {
  std::size_t unneeded = 0;
  for (std::uint32_t seed = 0; seed < testing::Scaled(100); ++seed) {
    MapProfile profile = testing::DrivesProfile(seed);
    profile.preset = FusionPreset::kBounded;
    profile.tile_cells = 32;
    profile.band_segments = static_cast<std::uint8_t>(1 + seed % 3);
    profile.band_vehicle_segments = static_cast<std::uint8_t>(1 + seed % 2);
    profile.band_mm = 8'000;
    auto keyframes = testing::RandomDrives(profile, seed);
    for (PlacedKeyframe& k : keyframes) {
      k.key.sequence *= profile.stretch_keyframes;
    }
    const Indices needed = Needs(keyframes, profile).OfAll();
    EXPECT_EQ(Needs(keyframes, profile).OfAll(1), needed) << "in bands, seed " << seed;
    std::vector<PlacedKeyframe> rest;
    for (const std::size_t i : needed) {
      rest.push_back(keyframes[i]);
    }
    EXPECT_EQ(FuseTile({0, 0, 0}, rest, profile), FuseTile({0, 0, 0}, keyframes, profile))
        << "seed " << seed;
    unneeded += keyframes.size() - rest.size();
  }
  EXPECT_GT(unneeded, 0u);
}

TEST(FrameNeedsTest, TheOrderTheyAreGivenInDoesNotMatter) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(20); ++seed) {
    MapProfile profile = testing::DrivesProfile(seed);
    profile.preset = FusionPreset::kBounded;
    profile.band_segments = 1;
    auto keyframes = testing::RandomDrives(profile, seed);
    const auto keys = [&](const Indices& indices) {
      std::set<KeyframeKey> found;
      for (const std::size_t i : indices) {
        found.insert(keyframes[i].key);
      }
      return found;
    };
    const auto needed = keys(Needs(keyframes, profile).OfAll());
    std::mt19937 random(seed);
    std::shuffle(keyframes.begin(), keyframes.end(), random);
    EXPECT_EQ(keys(Needs(keyframes, profile).OfAll()), needed) << "seed " << seed;
  }
}

}  // namespace
}  // namespace atlas
