// A real street (kitti_0005) full of people who walk, a cyclist and a van: what moves leaves no
// trail where the vehicle drove, what stands is kept.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include <gtest/gtest.h>

#include "tests/data/street_map.h"
#include "tests/data/street_squares.h"

namespace atlas::testing {
namespace {

constexpr double kSensorHeight_m = 1.73;
constexpr double kCell_m = 0.1;
constexpr int kCellsAMetre = 10;

std::int64_t CellAt(double m) {
  return static_cast<std::int64_t>(std::floor(m / kCell_m));
}

class StreetTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const char* data = std::getenv("ATLAS_DATA");
    if (data != nullptr && std::filesystem::is_directory(Folder(data))) {
      street_ = std::make_unique<StreetMap>(Folder(data), kSensorHeight_m);
    }
  }
  static void TearDownTestSuite() { street_.reset(); }
  void SetUp() override {
    if (street_ == nullptr) {
      GTEST_SKIP() << "kitti_0005 is not in $ATLAS_DATA (docs/data.md)";
    }
  }

  // Cells within a metre of the driven path with a segment 0.5 to 2 m above its road.
  static int OccupiedOnPath() {
    int occupied = 0;
    for (const DriveScan& scan : street_->drive().scans) {
      const Eigen::Vector3d p = scan.T_world_sensor.translation();
      const double road_m = p.z() - kSensorHeight_m;
      for (int dy = -kCellsAMetre; dy <= kCellsAMetre; ++dy) {
        for (int dx = -kCellsAMetre; dx <= kCellsAMetre; ++dx) {
          const bool is_near = dx * dx + dy * dy <= kCellsAMetre * kCellsAMetre;
          occupied += is_near && street_->IsOccupied(CellAt(p.x()) + dx, CellAt(p.y()) + dy,
                                                     road_m + 0.5, road_m + 2.0)
                          ? 1
                          : 0;
        }
      }
    }
    return occupied;
  }

  static bool IsKept(std::int64_t x, std::int64_t y, const StreetSquare& square) {
    for (int cell = 0; cell < kCellsAMetre * kCellsAMetre; ++cell) {
      if (street_->IsOccupied(x * kCellsAMetre + cell % kCellsAMetre,
                              y * kCellsAMetre + cell / kCellsAMetre, square.road_m + 0.5,
                              square.road_m + 2.0)) {
        return true;
      }
    }
    return false;
  }

 private:
  static std::filesystem::path Folder(const char* data) {
    return std::filesystem::path(data) / "kitti_0005";
  }

 protected:
  inline static std::unique_ptr<StreetMap> street_;
};

TEST_F(StreetTest, NothingStandsWhereTheVehicleDrove) {
  EXPECT_EQ(OccupiedOnPath(), 0);
}

TEST_F(StreetTest, WhatStandsIsKept) {
  struct Count {
    int squares = 0;
    int kept = 0;
    double share() const { return static_cast<double>(kept) / squares; }
    void Add(bool is_kept) {
      ++squares;
      kept += is_kept ? 1 : 0;
    }
  };
  Count asked, standing, moved, ground;
  for (const auto& [key, square] : JudgeSquares(*street_)) {
    if (!square.is_asked_for()) {
      continue;
    }
    const bool is_kept = IsKept(key.first, key.second, square);
    asked.Add(is_kept);
    (square.stands() ? standing : square.rises() ? moved : ground).Add(is_kept);
  }
  const auto print = [](const char* what, const Count& count) {
    std::printf("%-45s %4d squares, occupied in the map: %.3f\n", what, count.squares,
                count.share());
  };
  print("20 returns 0.5 to 2 m above the road, 5 scans", asked);
  print("  which stand", standing);
  print("  which moved: gone in most scans", moved);
  print("  which are raised ground", ground);
  EXPECT_GT(standing.squares, 200);
  EXPECT_GE(standing.share(), 0.95);
  EXPECT_LE(moved.share(), 0.5) << "what moves leaves trails";
}

}  // namespace
}  // namespace atlas::testing
