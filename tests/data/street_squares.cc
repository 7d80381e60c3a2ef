#include "tests/data/street_squares.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>

namespace atlas::testing {
namespace {

constexpr double kLow_m = 0.5;
constexpr double kHigh_m = 2.0;
constexpr double kReach_m = 20.0;
constexpr double kOwnGround_m = 0.3;  // the profile's column base offset
constexpr double kRayStep_m = 0.25;
constexpr int kManyRays = 20;

using Key = std::pair<std::int64_t, std::int64_t>;

Key KeyOf(const Eigen::Vector3d& p) {
  return {static_cast<std::int64_t>(std::floor(p.x())),
          static_cast<std::int64_t>(std::floor(p.y()))};
}

struct Square : StreetSquare {
  std::vector<float> heights_m;  // of every return in it
  double ground_m = 0.0;
  // In the scan at hand:
  int returns = 0;
  int own_returns = 0;
  int rays = 0;
};

// Squares by position: a dense table, for every ray asks every few steps.
class Squares {
 public:
  explicit Squares(const StreetMap& street) {
    for (std::int64_t y = -kHalfSide; y < kHalfSide; ++y) {
      for (std::int64_t x = -kHalfSide; x < kHalfSide; ++x) {
        const StreetMap::Road road =
            street.RoadAt(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
        if (road.distance_m >= 3.0 && road.distance_m <= 10.0) {
          index_[Slot({x, y})] = static_cast<int>(squares_.size());
          keys_.emplace_back(x, y);
          squares_.emplace_back().road_m = road.z_m;
        }
      }
    }
  }

  Square* Find(const Eigen::Vector3d& p) {
    const Key key = KeyOf(p);
    const bool is_inside = std::max(std::abs(key.first), std::abs(key.second)) < kHalfSide;
    const int index = is_inside ? index_[Slot(key)] : -1;
    return index < 0 ? nullptr : &squares_[static_cast<std::size_t>(index)];
  }
  std::vector<Square>& all() { return squares_; }
  const Key& key(std::size_t i) const { return keys_[i]; }

 private:
  static constexpr std::int64_t kHalfSide = 128;
  static std::size_t Slot(const Key& key) {
    return static_cast<std::size_t>((key.second + kHalfSide) * 2 * kHalfSide + key.first +
                                    kHalfSide);
  }

  std::vector<int> index_ = std::vector<int>(4 * kHalfSide * kHalfSide, -1);
  std::vector<Square> squares_;
  std::vector<Key> keys_;
};

bool IsInBand(const Square& square, double z_m) {
  return z_m >= square.road_m + kLow_m && z_m <= square.road_m + kHigh_m;
}

// The lowest twentieth of a square's returns, but no thicker than what counts as ground.
void FindGround(Square& square) {
  std::vector<float>& z = square.heights_m;
  if (z.empty()) {
    square.ground_m = std::numeric_limits<double>::infinity();
    return;
  }
  std::sort(z.begin(), z.end());
  square.ground_m = std::min<double>(z[z.size() / 20], z.front() + kOwnGround_m);
}

void CountReturn(const Eigen::Vector3d& p, Squares& squares) {
  Square* square = squares.Find(p);
  if (square != nullptr && IsInBand(*square, p.z())) {
    ++square->returns;
    square->own_returns += p.z() >= square->ground_m + kOwnGround_m ? 1 : 0;
  }
}

void CountRay(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Squares& squares) {
  const double length_m = (to - from).head<2>().norm();
  const Square* last = nullptr;
  for (double r = kRayStep_m; r <= std::min(length_m, kReach_m); r += kRayStep_m) {
    const Eigen::Vector3d p = from + (to - from) * (r / length_m);
    Square* square = squares.Find(p);
    if (square != nullptr && square != last && IsInBand(*square, p.z())) {
      ++square->rays;
      last = square;
    }
  }
}

void FinishScan(Squares& squares) {
  for (Square& square : squares.all()) {
    square.scans_with_20 += square.returns >= kManyRays ? 1 : 0;
    square.scans_with_20_own += square.own_returns >= kManyRays ? 1 : 0;
    square.scans_looking += square.rays >= kManyRays ? 1 : 0;
    square.scans_present += square.rays >= kManyRays && square.own_returns > 0 ? 1 : 0;
    square.returns = square.own_returns = square.rays = 0;
  }
}

template <typename Visit>
void ForEachReturn(const StreetMap& street, std::size_t scan, Visit&& visit) {
  const Pose& T_world_sensor = street.drive().scans[scan].T_world_sensor;
  for (const Eigen::Vector3f& p_sensor : street.clouds()[scan].points) {
    visit(T_world_sensor * p_sensor.cast<double>(), p_sensor.norm() <= kReach_m);
  }
}

}  // namespace

std::map<Key, StreetSquare> JudgeSquares(const StreetMap& street) {
  Squares squares(street);
  const std::size_t scans = street.clouds().size();
  for (std::size_t i = 0; i < scans; ++i) {
    ForEachReturn(street, i, [&squares](const Eigen::Vector3d& p, bool is_near) {
      if (Square* square = is_near ? squares.Find(p) : nullptr; square != nullptr) {
        square->heights_m.push_back(static_cast<float>(p.z()));
      }
    });
  }
  for (Square& square : squares.all()) {
    FindGround(square);
  }
  for (std::size_t i = 0; i < scans; ++i) {
    const Eigen::Vector3d sensor = street.drive().scans[i].T_world_sensor.translation();
    ForEachReturn(street, i, [&](const Eigen::Vector3d& p, bool is_near) {
      CountRay(sensor, p, squares);
      if (is_near) {
        CountReturn(p, squares);
      }
    });
    FinishScan(squares);
  }
  std::map<Key, StreetSquare> judged;
  for (std::size_t i = 0; i < squares.all().size(); ++i) {
    judged.emplace(squares.key(i), squares.all()[i]);
  }
  return judged;
}

}  // namespace atlas::testing
