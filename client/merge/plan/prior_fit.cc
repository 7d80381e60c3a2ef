#include "client/merge/plan/prior_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/hash_random.h"

namespace atlas {
namespace {

// With half of the pairs wrong a draw of two is right once in four.
constexpr std::uint64_t kDraws = 256;
constexpr int kRounds = 10;

// Three sigmas along each axis, as a ball.
double WithinOf(const KnownPair& pair, double slack_m) {
  return 3.0 * std::sqrt(3.0) * pair.radius_m + slack_m;
}

double DistanceOf(const KnownPair& pair, const Pose& T_world_part) {
  return (T_world_part * pair.p_part - pair.p_world).norm();
}

Pose Turned(double yaw_rad) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return pose;
}

double AngleOf(const Eigen::Vector3d& way) {
  return std::atan2(way.y(), way.x());
}

// What two pairs say; their middle stays the middle.
Pose ByTwo(const KnownPair& a, const KnownPair& b) {
  Pose pose = Turned(AngleOf(b.p_world - a.p_world) - AngleOf(b.p_part - a.p_part));
  pose.translation() = 0.5 * (a.p_world + b.p_world - pose.linear() * (a.p_part + b.p_part));
  return pose;
}

// Least squares of weighted pairs.
Pose ByAll(std::span<const KnownPair> pairs, const std::vector<double>& weights) {
  double sum = 0.0;
  Eigen::Vector3d middle_part = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle_world = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    sum += weights[i];
    middle_part += weights[i] * pairs[i].p_part;
    middle_world += weights[i] * pairs[i].p_world;
  }
  middle_part /= sum;
  middle_world /= sum;
  double along = 0.0;
  double across = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d part = pairs[i].p_part - middle_part;
    const Eigen::Vector3d world = pairs[i].p_world - middle_world;
    along += weights[i] * part.head<2>().dot(world.head<2>());
    across += weights[i] * (part.x() * world.y() - part.y() * world.x());
  }
  Pose pose = Turned(std::atan2(across, along));
  pose.translation() = middle_world - pose.linear() * middle_part;
  return pose;
}

class Fit {
 public:
  Fit(std::span<const KnownPair> pairs, const PriorOptions& options)
      : pairs_(pairs), options_(options) {}

  std::optional<Pose> Run() const {
    if (pairs_.size() < options_.min_priors) return std::nullopt;
    std::optional<Pose> pose = BestOfDraws();
    if (!pose) return std::nullopt;
    for (int i = 0; i < kRounds; ++i) {
      pose = ByAll(pairs_, WeightsAt(*pose));
    }
    const std::size_t agreeing = CountAgreeing(pairs_, *pose, options_.slack_m);
    const bool is_believed =
        agreeing >= options_.min_priors &&
        static_cast<double>(agreeing) >= options_.min_share * static_cast<double>(pairs_.size());
    return is_believed && TellsHeading(*pose) ? pose : std::nullopt;
  }

 private:
  std::optional<Pose> BestOfDraws() const {
    const auto count = static_cast<std::uint32_t>(pairs_.size());
    std::optional<Pose> best;
    double least = 0.0;
    for (std::uint64_t draw = 0; draw < kDraws; ++draw) {
      HashRandom random(draw);
      const KnownPair& a = pairs_[random.Below(count)];
      const KnownPair& b = pairs_[random.Below(count)];
      const double apart_m = (a.p_part - b.p_part).head<2>().norm();
      if (apart_m < options_.min_spread * std::max(a.radius_m, b.radius_m)) continue;
      const Pose pose = ByTwo(a, b);
      const double cost = CostOf(pose);
      if (best && cost >= least) continue;
      best = pose;
      least = cost;
    }
    return best;
  }

  double CostOf(const Pose& pose) const {
    double cost = 0.0;
    for (const KnownPair& pair : pairs_) {
      const double off = DistanceOf(pair, pose) / WithinOf(pair, options_.slack_m);
      cost += std::min(1.0, off * off);
    }
    return cost;
  }

  std::vector<double> WeightsAt(const Pose& pose) const {
    std::vector<double> weights;
    weights.reserve(pairs_.size());
    for (const KnownPair& pair : pairs_) {
      const double within_m = WithinOf(pair, options_.slack_m);
      const double off = DistanceOf(pair, pose) / within_m;
      const double robust = 1.0 / (1.0 + off * off);
      weights.push_back(robust * robust / (within_m * within_m));
    }
    return weights;
  }

  // Whether those that agree are far enough from each other, root mean square.
  bool TellsHeading(const Pose& pose) const {
    double count = 0.0;
    double radius_m = 0.0;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double squares_m2 = 0.0;
    for (const KnownPair& pair : pairs_) {
      if (DistanceOf(pair, pose) > WithinOf(pair, options_.slack_m)) continue;
      count += 1.0;
      radius_m += pair.radius_m;
      sum += pair.p_part.head<2>();
      squares_m2 += pair.p_part.head<2>().squaredNorm();
    }
    const double spread_m2 = squares_m2 / count - (sum / count).squaredNorm();
    return spread_m2 >= std::pow(options_.min_spread * radius_m / count, 2);
  }

  std::span<const KnownPair> pairs_;
  const PriorOptions& options_;
};

}  // namespace

std::size_t CountAgreeing(std::span<const KnownPair> pairs,
                          const Pose& T_world_part,
                          double slack_m) {
  return static_cast<std::size_t>(
      std::count_if(pairs.begin(), pairs.end(), [&](const KnownPair& pair) {
        return DistanceOf(pair, T_world_part) <= WithinOf(pair, slack_m);
      }));
}

std::optional<Pose> FitToPriors(std::span<const KnownPair> pairs, const PriorOptions& options) {
  return Fit(pairs, options).Run();
}

}  // namespace atlas
