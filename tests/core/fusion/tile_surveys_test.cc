// Whatever happened to a tile's keyframes in between, its kept surveys make the tile that a fusion
// from nothing makes, and only what changed is surveyed again.
#include "core/fusion/tile_surveys.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/str_cat.h"
#include "tests/core/fusion/random_drives.h"
#include "tests/core/support/test_scale.h"

namespace atlas {
namespace {

using testing::DrivesProfile;
using testing::RandomDrives;

// A tile's kept surveys beside the keyframes that they are made of.
class KeptTile {
 public:
  explicit KeptTile(const MapProfile& profile)
      : profile_(profile), sigmas_(profile_, 64), surveys_({0, 0, 0}) {}

  // Updates and compares; returns how many keyframes were surveyed.
  std::size_t Update(const std::vector<PlacedKeyframe>& keyframes) {
    const std::vector<FrameOnMap> expected =
        surveys_.Expect(ChangeTo(keyframes), {profile_, sigmas_});
    for (const FrameOnMap& frame : expected) {
      const auto named = std::find_if(keyframes.begin(), keyframes.end(),
                                      [&](const auto& k) { return k.key == frame.key; });
      EXPECT_EQ(named->placement, frame.placement);
      EXPECT_EQ(named->keyframe->grid, frame.grid);
      surveys_.Add(frame, *named->keyframe, {profile_, sigmas_});
    }
    EXPECT_EQ(surveys_.Combine({profile_, sigmas_}), FuseTile({0, 0, 0}, keyframes, profile_));
    return expected.size();
  }

  TileSurveys& surveys() { return surveys_; }

  void SaveAndLoad() {
    const Bytes saved = surveys_.Save();
    surveys_ = TileSurveys::Load(saved, {0, 0, 0}, profile_).value();
    EXPECT_EQ(surveys_.Save(), saved);
    surveys_.Unpack();
  }

 private:
  // What is not as it was told last, and something that is, as if it had moved there and back.
  TileChange ChangeTo(const std::vector<PlacedKeyframe>& keyframes) {
    TileChange change;
    std::map<KeyframeKey, KeyframePlacement> now;
    for (const PlacedKeyframe& k : keyframes) {
      now[k.key] = k.placement;
      const std::uint64_t content = contents_.try_emplace(k.key, contents_.size()).first->second;
      const auto told = told_.find(k.key);
      if (told == told_.end() || told->second != k.placement || content % 7 == told_.size() % 7) {
        change.present.push_back({k.key, k.time_ms, k.placement, k.keyframe->grid, content});
      }
    }
    for (const auto& [key, placement] : told_) {
      if (!now.contains(key)) {
        change.absent.push_back(contents_.at(key));
      }
    }
    change.absent.push_back(1'000'000);  // never heard of
    told_ = std::move(now);
    return change;
  }

  std::map<KeyframeKey, std::uint64_t> contents_;
  std::map<KeyframeKey, KeyframePlacement> told_;
  MapProfile profile_;
  SigmaTable sigmas_;
  TileSurveys surveys_;
};

TEST(TileSurveysTest, FollowAnyChange) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(40); ++seed) {
    MapProfile profile = DrivesProfile(seed);
    profile.preset = seed % 2 == 0 ? FusionPreset::kBounded : FusionPreset::kStrict;
    const auto all = RandomDrives(profile, seed);
    std::mt19937 random(seed);
    std::vector<PlacedKeyframe> current;
    KeptTile tile(profile);
    for (int step = 0; step < 60; ++step) {
      const std::size_t pick = random() % all.size();
      if (random() % 3 == 0 && !current.empty()) {
        current.erase(current.begin() +
                      static_cast<std::ptrdiff_t>(random() % current.size()));  // goes
      }
      std::erase_if(current, [&](const PlacedKeyframe& k) { return k.key == all[pick].key; });
      current.push_back(all[pick]);
      if (random() % 3 == 0) {  // moves
        current.back().placement.x_um += static_cast<std::int64_t>(random() % 300'000);
      }
      tile.Update(current);
      switch (random() % 4) {
        case 0:
          tile.surveys().Pack();
          tile.surveys().Unpack();
          break;
        case 1:
          tile.SaveAndLoad();
          break;
        case 2:
          tile.surveys().Save();  // they stay as they are
          break;
        default:
          break;
      }
    }
    EXPECT_EQ(tile.Update(current), 0u) << "nothing changed, seed " << seed;
  }
}

TEST(TileSurveysTest, WhatIsLoadedNeedsNoKeyframes) {
  const MapProfile profile = DrivesProfile(0);
  KeptTile tile(profile);
  const auto keyframes = RandomDrives(profile, 7);
  EXPECT_GT(tile.Update(keyframes), 0u);
  tile.SaveAndLoad();
  EXPECT_EQ(tile.Update(keyframes), 0u);
}

TEST(TileSurveysTest, CutBytesAreNotLoaded) {
  const MapProfile profile = DrivesProfile(0);
  KeptTile tile(profile);
  tile.Update(RandomDrives(profile, 7));
  Bytes saved = tile.surveys().Save();
  for (std::size_t size = 0; size < saved.size(); size += 1 + saved.size() / 500) {
    const auto cut = TileSurveys::Load(ByteSpan(saved).first(size), {0, 0, 0}, profile);
    ASSERT_FALSE(cut.has_value()) << size;
    EXPECT_EQ(cut.error().code(), StatusCode::kInvalidData);
  }
  saved.push_back(0);
  EXPECT_FALSE(TileSurveys::Load(saved, {0, 0, 0}, profile).has_value());
}

TEST(TileSurveysTest, WhatFollowsIsAddedAndOnlyChangedStretchesAreSurveyedAgain) {
  MapProfile profile = DrivesProfile(0);  // stretches of 16
  KeptTile tile(profile);
  std::vector<PlacedKeyframe> keyframes;
  for (std::uint32_t i = 0; i < 48; ++i) {
    keyframes.push_back(testing::PlacedFrame({"car", "a", i}, {0.8, 0.8 + 0.01 * i},
                                             testing::RandomKeyframe(profile, 12, i)));
    EXPECT_EQ(tile.Update(keyframes), 1u) << i;
  }
  keyframes[20].placement.x_um += 1'000;
  EXPECT_EQ(tile.Update(keyframes), 16u);
  keyframes.erase(keyframes.begin() + 40);
  EXPECT_EQ(tile.Update(keyframes), 15u);
  keyframes.resize(32);
  EXPECT_EQ(tile.Update(keyframes), 0u);
}

// What a correction costs does not grow with what was ever recorded there: passes that count no
// more stay forgotten.
TEST(TileSurveysTest, ACorrectionAmongManyPassesCostsOneStretch) {
  for (const std::uint32_t vehicles : {1u, 5u}) {
    MapProfile profile = DrivesProfile(0);
    profile.preset = FusionPreset::kBounded;
    KeptTile tile(profile);
    std::vector<PlacedKeyframe> keyframes;
    constexpr std::uint32_t kPasses = 24;
    constexpr std::uint32_t kFrames = 4;
    for (std::uint32_t pass = 0; pass < kPasses; ++pass) {
      const std::string vehicle = StrCat("car", pass % vehicles);
      const std::string session = StrCat("pass", 100 + pass);
      for (std::uint32_t i = 0; i < kFrames; ++i) {
        keyframes.push_back(testing::PlacedFrame({vehicle, session, i}, {0.8, 0.8 + 0.1 * i},
                                                 testing::StreetKeyframe(profile, 12, i)));
        keyframes.back().time_ms = 1'000'000 * std::int64_t{pass} + 1'000 * i;
        tile.Update(keyframes);
      }
    }
    for (const std::uint32_t pass : {2u, 21u, 2u, 22u, 20u, 21u, 12u}) {
      for (const std::int64_t moved_um : {30'000, -30'000}) {
        for (std::uint32_t i = 0; i < kFrames; ++i) {
          keyframes[pass * kFrames + i].placement.x_um += moved_um;
        }
        EXPECT_EQ(tile.Update(keyframes), kFrames) << vehicles << " vehicles, pass " << pass;
      }
    }
  }
}

// Decks whose drives wander up and down, past each other: what is one layer now is two then, and a
// layer's altitude is far from that of the segments that it is made of.
TEST(TileSurveysTest, FollowDecksThatWander) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(30); ++seed) {
    MapProfile profile = DrivesProfile(0);
    profile.preset = seed % 2 == 0 ? FusionPreset::kBounded : FusionPreset::kStrict;
    std::mt19937 random(seed);
    const auto below = [&](std::int64_t n) {
      return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(n));
    };
    KeptTile tile(profile);
    std::vector<PlacedKeyframe> keyframes;
    std::array<std::int64_t, 4> deck_um = {0, 3'200'000, 6'400'000, 9'600'000};
    for (std::uint32_t i = 0; i < 60; ++i) {
      const auto deck = static_cast<std::size_t>(below(4));
      deck_um[deck] += below(900'000) - (seed % 3 == 0 ? 100'000 : 450'000);
      keyframes.push_back(testing::PlacedFrame(
          {"car", StrCat("deck", deck), i},
          {0.1 * static_cast<double>(below(16)), 0.1 * static_cast<double>(below(16))},
          random() % 3 == 0 ? testing::RandomKeyframe(profile, 12, i)
                            : testing::StreetKeyframe(profile, 12, i)));
      keyframes.back().placement.z_um += deck_um[deck];
      tile.Update(keyframes);
      if (::testing::Test::HasFailure()) {
        FAIL() << "seed " << seed << ", step " << i;
      }
    }
  }
}

// Ground that rises under a vehicle that comes nearer: its layer, the mean of what was seen, stays
// behind, where guesses of others are taken for it.
TEST(TileSurveysTest, FollowGroundThatRises) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(40); ++seed) {
    MapProfile profile = DrivesProfile(0);
    profile.preset = seed % 2 == 0 ? FusionPreset::kBounded : FusionPreset::kStrict;
    std::mt19937 random(seed);
    const auto below_m = [&](double limit_m) {
      return limit_m * static_cast<double>(random() % 1'000) / 1'000.0;
    };
    KeptTile tile(profile);
    std::vector<PlacedKeyframe> keyframes;
    const auto see = [&](const std::string& session, const testing::MapPose& pose, bool is_street) {
      const auto i = static_cast<std::uint32_t>(keyframes.size());
      keyframes.push_back(testing::PlacedFrame({"car", session, i}, pose,
                                               is_street
                                                   ? testing::StreetKeyframe(profile, 16, 1)
                                                   : testing::RandomKeyframe(profile, 16, i)));
      tile.Update(keyframes);
    };
    see("deck", {0.8, 0.8, 12.0}, true);
    for (int i = 0; i < 14; ++i) {
      see("rising", {1.5 - 0.1 * i, 0.8, 0.45 * i}, true);
      see("guessing", {below_m(1.6), below_m(1.6), below_m(6.0) - 1.0}, false);
      if (::testing::Test::HasFailure()) {
        FAIL() << "seed " << seed << ", step " << i;
      }
    }
  }
}

// Neither the size of what is kept nor what it costs: what counts no more is forgotten.
TEST(TileSurveysTest, WhatIsKeptDoesNotGrowWithThePasses) {
  MapProfile profile = DrivesProfile(0);
  profile.preset = FusionPreset::kBounded;
  KeptTile tile(profile);
  std::vector<PlacedKeyframe> keyframes;
  std::vector<std::size_t> saved_bytes;
  for (std::uint32_t pass = 0; pass < 40; ++pass) {
    keyframes.push_back(testing::PlacedFrame({"car", StrCat("pass", 100 + pass), 0}, {0.8, 0.8},
                                             testing::StreetKeyframe(profile, 12, 0)));
    keyframes.back().time_ms = 1'000'000 * std::int64_t{pass};
    tile.Update(keyframes);
    for (int idle = 0; idle < 3; ++idle) {
      tile.Update(keyframes);
    }
    saved_bytes.push_back(tile.surveys().Save().size());
  }
  constexpr std::size_t kFrameBytes = 100;  // each is still known by name, place and time
  EXPECT_LT(saved_bytes[39], saved_bytes[12] + 27 * kFrameBytes);
  // When all that was seen lately goes, what was forgotten is asked for.
  keyframes.resize(20);
  EXPECT_GT(tile.Update(keyframes), 10u);
}

// Of yesterday, uploaded while others drive there, or by a clock that is ahead of the others'. What
// it sees has been forgotten as soon as it settles: it would start over each time.
TEST(TileSurveysTest, OlderDrivesBesideLiveOnesAreAddedToLikeThem) {
  MapProfile profile = DrivesProfile(0);
  profile.preset = FusionPreset::kBounded;
  profile.stretch_keyframes = 256;
  KeptTile tile(profile);
  std::vector<PlacedKeyframe> keyframes;
  const auto see = [&](const std::string& vehicle, std::uint32_t i, std::int64_t time_ms) {
    keyframes.push_back(testing::PlacedFrame({vehicle, StrCat("s", time_ms / 10'000'000), i},
                                             {0.8, 0.8 + 0.01 * i},
                                             testing::StreetKeyframe(profile, 12, i)));
    keyframes.back().time_ms = time_ms + 1'000 * std::int64_t{i};
    return tile.Update(keyframes);
  };
  for (int pass = 0; pass < 10; ++pass) {
    see("old", 0, 50'000'000 + 10'000'000 * pass);
  }
  for (std::uint32_t i = 0; i < 30; ++i) {
    EXPECT_EQ(see("a", i, 200'000'000), 1u) << i;
    EXPECT_EQ(see("b", i, 200'000'000), 1u) << i;
    EXPECT_EQ(see("ahead", i, 200'061'000), 1u) << i;
    EXPECT_EQ(see("old", i, 0), 1u) << i;
  }
}

// Passes that see several segments in most bands of a cell, three of them corrected at once, again
// and again.
TEST(TileSurveysTest, ThreePassesAtOnceCostThreeStretches) {
  for (const std::uint32_t vehicles : {1u, 3u, 12u}) {
    MapProfile profile = DrivesProfile(0);
    profile.preset = FusionPreset::kBounded;
    KeptTile tile(profile);
    std::vector<PlacedKeyframe> keyframes;
    constexpr std::uint32_t kPasses = 30;
    for (std::uint32_t pass = 0; pass < kPasses; ++pass) {
      keyframes.push_back(
          testing::PlacedFrame({StrCat("car", pass % vehicles), StrCat("pass", 100 + pass), 0},
                               {0.8, 0.8}, testing::RandomKeyframe(profile, 12, pass)));
      keyframes.back().time_ms = 1'000'000 * std::int64_t{pass};
      tile.Update(keyframes);
    }
    std::mt19937 random(vehicles);
    const auto below = [&](std::uint32_t n) {
      return static_cast<std::uint32_t>(random() % n);
    };
    for (int batch = 0; batch < 60; ++batch) {
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t pass = below(2) == 0 ? kPasses - 1 - below(5) : below(kPasses);
        keyframes[pass].placement.x_um += 1'000;
      }
      EXPECT_LE(tile.Update(keyframes), 3u) << vehicles << " vehicles, batch " << batch;
      for (int idle = 0; idle < 3; ++idle) {
        tile.Update(keyframes);  // they settle
      }
    }
  }
}

// What little a cell may hold is pushed out all the time, and comes back all the time.
TEST(TileSurveysTest, WhatWasForgottenComesBackWhenItCounts) {
  for (std::uint32_t seed = 0; seed < testing::Scaled(20); ++seed) {
    MapProfile profile = DrivesProfile(seed);
    profile.preset = FusionPreset::kBounded;
    profile.band_segments = static_cast<std::uint8_t>(1 + seed % 4);
    profile.band_vehicle_segments = static_cast<std::uint8_t>(1 + seed % 2);
    ASSERT_TRUE(profile.Validate().ok());
    KeptTile tile(profile);
    std::mt19937 random(seed);
    std::vector<PlacedKeyframe> keyframes;
    for (std::uint32_t pass = 0; pass < 100; ++pass) {
      keyframes.push_back(testing::PlacedFrame(
          {StrCat("car", random() % (1 + seed % 5)), StrCat("pass", 100 + pass), 0}, {0.8, 0.8},
          testing::RandomKeyframe(profile, 8, pass)));
      keyframes.back().time_ms = 100'000 * static_cast<std::int64_t>(random() % 60);
      for (auto& keyframe : keyframes) {
        if (random() % 20 == 0) {
          keyframe.placement.x_um += 1'000;
        }
      }
      if (random() % 15 == 0) {  // the latest are retracted
        const auto cut_ms = 100'000 * static_cast<std::int64_t>(random() % 60);
        std::erase_if(keyframes, [&](const PlacedKeyframe& k) { return k.time_ms > cut_ms; });
      }
      tile.Update(keyframes);
      if (random() % 5 == 0) {
        tile.SaveAndLoad();
      }
    }
  }
}

}  // namespace
}  // namespace atlas
