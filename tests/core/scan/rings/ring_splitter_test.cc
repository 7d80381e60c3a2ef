// Rings in every order that a file may have them in, and scans that have none.
#include "core/scan/rings/ring_splitter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/core/support/synthetic_scan.h"

namespace atlas {
namespace {

using testing::GroundRange;
using testing::Nearest;
using testing::Rings;
using testing::RoundWallRange;

struct Storage {
  bool is_top_first = false;
  bool is_clockwise = false;
  double begin_rad = 0.0;
};

struct Sample {
  PointCloud cloud;
  std::vector<int> ring;  // of each return, 0 = lowest
};

constexpr int kColumns = 900;

// Where column c of a ring points, in the order of the file.
double AzimuthOf(int column, const Storage& storage) {
  const double turned = (column + 0.5) * 2.0 * std::numbers::pi / kColumns;
  return storage.begin_rad + (storage.is_clockwise ? -turned : turned);
}

Sample MakeScan(const std::vector<double>& elevations,
                const Storage& storage,
                const testing::World& world) {
  Sample sample;
  const int rings = static_cast<int>(elevations.size());
  for (int k = 0; k < rings; ++k) {
    const int ring = storage.is_top_first ? rings - 1 - k : k;
    const double elevation = elevations[static_cast<std::size_t>(ring)] * testing::kDegree;
    for (int column = 0; column < kColumns; ++column) {
      const double azimuth = AzimuthOf(column, storage);
      const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const std::optional<double> range = world(direction);
      if (range && *range < 100.0) {
        sample.cloud.points.emplace_back((*range * direction).cast<float>());
        sample.ring.push_back(ring);
      }
    }
  }
  return sample;
}

std::optional<double> Yard(const Eigen::Vector3d& direction) {
  return Nearest(GroundRange(direction, 1.8), RoundWallRange(direction, 25.0));
}

std::vector<Storage> AllStorages() {
  std::vector<Storage> storages;
  for (const double begin_rad : {0.0, std::numbers::pi, 1.0, 2.5, 4.3, 6.2}) {
    for (int bits = 0; bits < 4; ++bits) {
      storages.push_back({(bits & 1) != 0, (bits & 2) != 0, begin_rad});
    }
  }
  return storages;
}

// Runs follow each other, cover everything and never turn back by more than a ring's jitter.
void ExpectWellFormed(const RingSplit& split) {
  ASSERT_EQ(split.index.size(), split.azimuth_rad.size());
  EXPECT_TRUE(std::is_sorted(split.index.begin(), split.index.end()));
  std::uint32_t at = 0;
  for (const RingRun& run : split.runs) {
    ASSERT_EQ(run.begin, at);
    ASSERT_GT(run.end, run.begin);
    at = run.end;
  }
  ASSERT_EQ(at, split.index.size());
  for (const float azimuth : split.azimuth_rad) {
    ASSERT_GE(azimuth, 0.0F);
    ASSERT_LE(azimuth, 2.0F * std::numbers::pi_v<float>);
  }
}

// The returns of each run that are of another ring than the first one's.
int Strays(const RingSplit& split, const Sample& sample) {
  int strays = 0;
  for (const RingRun& run : split.runs) {
    for (std::uint32_t i = run.begin; i < run.end; ++i) {
      strays += sample.ring[split.index[i]] != sample.ring[split.index[run.begin]] ? 1 : 0;
    }
  }
  return strays;
}

TEST(RingSplitterTest, EveryStorageOrderMakesOneRunARing) {
  for (const Storage& storage : AllStorages()) {
    for (const auto& elevations : {Rings(16, -15, 2), Rings(64, -24.8, 0.42)}) {
      SCOPED_TRACE(::testing::Message() << storage.is_top_first << storage.is_clockwise
                                        << storage.begin_rad << ' ' << elevations.size());
      const Sample sample = MakeScan(elevations, storage, Yard);
      const RingSplit split = SplitRings(sample.cloud, EgoBox());
      ExpectWellFormed(split);
      EXPECT_EQ(split.runs.size(), elevations.size());
      EXPECT_EQ(Strays(split, sample), 0);
      EXPECT_EQ(split.is_bottom_first, !storage.is_top_first);
      for (const RingRun& run : split.runs) {
        const auto ring = static_cast<std::size_t>(sample.ring[split.index[run.begin]]);
        EXPECT_NEAR(run.elevation_rad, elevations[ring] * testing::kDegree, 1e-4);
      }
    }
  }
}

// However a VLP-16's scan of `world` is stored, each of `count` rings is one run.
template <typename World>
void ExpectRings(std::size_t count, const World& world) {
  for (const Storage& storage : AllStorages()) {
    SCOPED_TRACE(::testing::Message()
                 << storage.is_top_first << storage.is_clockwise << storage.begin_rad);
    const Sample sample = MakeScan(Rings(16, -15, 2), storage, world);
    const RingSplit split = SplitRings(sample.cloud, EgoBox());
    ExpectWellFormed(split);
    EXPECT_EQ(split.runs.size(), count);
    EXPECT_EQ(Strays(split, sample), 0);
    EXPECT_EQ(split.is_bottom_first, !storage.is_top_first);
  }
}

TEST(RingSplitterTest, RingsInTheSkyHaveNoRunAndMoveNoOther) {
  // An open place with one house: rings above the horizon see it or nothing.
  const auto world = [](const Eigen::Vector3d& d) {
    const bool is_house = std::atan2(d.y(), d.x()) > 0.5 && std::atan2(d.y(), d.x()) < 1.1 &&
                          d.z() < std::sin(6.0 * testing::kDegree);
    return Nearest(GroundRange(d, 1.8), is_house ? RoundWallRange(d, 20.0) : std::nullopt);
  };
  ExpectRings(11, world);  // -15 to -3 on the ground, -1 to 5 on the house
}

TEST(RingSplitterTest, AStreetThatUpperRingsSeeOnlyOnItsSidesIsCutWhereRingsBegin) {
  // Ahead and behind there is sky above the horizon: no return there tells that a ring goes on.
  const auto world = [](const Eigen::Vector3d& d) -> std::optional<double> {
    const double wall_m = (d.y() > 0.0 ? 7.0 : 9.0) / std::abs(d.y());
    const bool is_wall = wall_m * d.z() < 4.0;
    return Nearest(GroundRange(d, 1.8), is_wall ? std::optional(wall_m) : std::nullopt);
  };
  ExpectRings(16, world);
}

TEST(RingSplitterTest, AzimuthsThatJitterByAReturnOrTwoCutNoRing) {
  std::mt19937 random(3);
  std::normal_distribution<float> jitter(0.0F, 0.004F);  // radians: half a column
  Sample sample = MakeScan(Rings(16, -15, 2), {}, Yard);
  for (Eigen::Vector3f& p : sample.cloud.points) {
    p = Eigen::AngleAxisf(jitter(random), Eigen::Vector3f::UnitZ()) * p;
  }
  const RingSplit split = SplitRings(sample.cloud, EgoBox());
  ExpectWellFormed(split);
  EXPECT_EQ(split.runs.size(), 16U);
  EXPECT_LE(Strays(split, sample), 32);  // two a ring, where it begins
}

TEST(RingSplitterTest, LostReturnsDoNotJoinOrCutRings) {
  std::mt19937 random(4);
  for (const Storage& storage : AllStorages()) {
    Sample full = MakeScan(Rings(32, -24.8, 0.84), storage, Yard);
    Sample sample;
    for (std::size_t i = 0; i < full.cloud.size(); ++i) {
      if (random() % 10 < 6) {
        sample.cloud.points.push_back(full.cloud.points[i]);
        sample.ring.push_back(full.ring[i]);
      }
    }
    const RingSplit split = SplitRings(sample.cloud, EgoBox());
    ExpectWellFormed(split);
    EXPECT_EQ(split.runs.size(), 32U);
    EXPECT_EQ(Strays(split, sample), 0);
  }
}

TEST(RingSplitterTest, AFewReturnsAreARing) {
  for (std::size_t count = 1; count <= 5; ++count) {
    PointCloud cloud;
    for (std::size_t i = 0; i < count; ++i) {
      cloud.points.emplace_back(10.0F, 0.1F * static_cast<float>(i), -1.0F);
    }
    const RingSplit split = SplitRings(cloud, EgoBox());
    ExpectWellFormed(split);
    EXPECT_EQ(split.runs.size(), 1U);
  }
  PointCloud same;
  same.points.assign(1000, Eigen::Vector3f(7.0F, -3.0F, 0.5F));
  ExpectWellFormed(SplitRings(same, EgoBox()));
}

TEST(RingSplitterTest, AScanOfTheVehicleAloneHasNoRings) {
  PointCloud cloud;
  cloud.points.assign(500, Eigen::Vector3f(0.5F, 0.2F, -0.4F));
  cloud.points.emplace_back(0.0F, 0.0F, 0.0F);  // what some drivers write for a lost return
  const RingSplit split = SplitRings(cloud, EgoBox());
  EXPECT_TRUE(split.runs.empty());
  EXPECT_TRUE(split.index.empty());
}

TEST(RingSplitterTest, PointsInNoOrderAreStillCutIntoRuns) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> coordinate(-40.0F, 40.0F);
  for (int round = 0; round < 50; ++round) {
    PointCloud cloud;
    for (std::uint32_t i = 0; i < 1 + random() % 300; ++i) {
      cloud.points.emplace_back(coordinate(random), coordinate(random), coordinate(random) / 10.0F);
    }
    ExpectWellFormed(SplitRings(cloud, EgoBox()));
  }
}

}  // namespace
}  // namespace atlas
