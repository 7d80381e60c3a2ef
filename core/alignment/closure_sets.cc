#include "core/alignment/closure_sets.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace atlas {
namespace {

using Indices = std::vector<std::size_t>;

// Who agrees with whom, of those that are looked at.
class Agreement {
 public:
  Agreement(std::span<const Closure> closures,
            const Indices& looked_at,
            const SessionPair& sessions,
            const ConsistencyOptions& options)
      : size_(closures.size()), agree_(size_ * size_, 0) {
    for (const std::size_t i : looked_at) {
      for (const std::size_t j : looked_at) {
        if (i < j && AreConsistent(closures[i], closures[j], sessions, options)) {
          agree_[i * size_ + j] = agree_[j * size_ + i] = 1;
        }
      }
    }
  }

  bool operator()(std::size_t i, std::size_t j) const { return agree_[i * size_ + j] != 0; }

  Indices WithAll(const Indices& candidates, std::size_t one) const {
    Indices left;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(left),
                 [&](std::size_t other) { return (*this)(one, other); });
    return left;
  }

 private:
  std::size_t size_;
  std::vector<std::uint8_t> agree_;
};

Indices Weightiest(std::span<const Closure> closures, std::size_t count) {
  Indices indices(closures.size());
  std::iota(indices.begin(), indices.end(), 0U);
  std::stable_sort(indices.begin(), indices.end(), [&](std::size_t i, std::size_t j) {
    return closures[i].weight > closures[j].weight;
  });
  indices.resize(std::min(indices.size(), count));
  return indices;
}

// Whole numbers, so that what is added and taken away again leaves nothing behind.
using Weight = std::int64_t;

std::vector<Weight> WeightsOf(std::span<const Closure> closures) {
  constexpr double kUnits = 4'294'967'296.0;
  std::vector<Weight> weights;
  weights.reserve(closures.size());
  for (const Closure& closure : closures) weights.push_back(std::llround(closure.weight * kUnits));
  return weights;
}

Weight SumOf(const Indices& indices, const std::vector<Weight>& weights) {
  return std::accumulate(indices.begin(), indices.end(), Weight{0},
                         [&](Weight sum, std::size_t i) { return sum + weights[i]; });
}

// Around `first`: always whoever agrees with most of those that are left. Time by the square of
// how many there are.
Indices Grown(std::size_t first,
              const Indices& others,
              const Agreement& agree,
              const std::vector<Weight>& weights) {
  Indices set{first};
  Indices candidates = agree.WithAll(others, first);
  std::vector<Weight> support(weights);  // of a candidate its own and that of those it agrees with
  for (const std::size_t i : candidates) {
    support[i] += SumOf(agree.WithAll(candidates, i), weights);
  }
  while (!candidates.empty()) {
    const std::size_t best =
        *std::max_element(candidates.begin(), candidates.end(),
                          [&](std::size_t i, std::size_t j) { return support[i] < support[j]; });
    set.push_back(best);
    const auto dropped =
        std::stable_partition(candidates.begin(), candidates.end(),
                              [&](std::size_t other) { return agree(best, other); });
    std::for_each(dropped, candidates.end(), [&](std::size_t gone) {
      std::for_each(candidates.begin(), dropped, [&](std::size_t left) {
        if (agree(gone, left)) support[left] -= weights[gone];
      });
    });
    candidates.erase(dropped, candidates.end());
  }
  return set;
}

// The ones with whom most agree come first; few starts find what all would.
Indices HeaviestSet(const Indices& indices,
                    const Agreement& agree,
                    const std::vector<Weight>& weights) {
  constexpr std::size_t kStarts = 16;
  std::vector<std::pair<Weight, std::size_t>> starts;
  for (const std::size_t i : indices) {
    starts.emplace_back(-weights[i] - SumOf(agree.WithAll(indices, i), weights), i);
  }
  std::sort(starts.begin(), starts.end());
  Indices heaviest;
  for (std::size_t k = 0; k < std::min(kStarts, starts.size()); ++k) {
    Indices set = Grown(starts[k].second, indices, agree, weights);
    const bool is_heavier = heaviest.empty() || SumOf(set, weights) > SumOf(heaviest, weights);
    if (is_heavier) heaviest = std::move(set);
  }
  std::sort(heaviest.begin(), heaviest.end());
  return heaviest;
}

double YawOf(const Pose& pose) {
  return SplitYaw(Eigen::Quaterniond(pose.linear())).yaw_rad;
}

// Whether `one` puts the submap `b` of `other` where `other` does.
bool Confirms(const Closure& one,
              const Closure& other,
              const SessionPair& sessions,
              const ConsistencyOptions& options) {
  const auto& [a, b] = sessions;
  const Pose T_a_other = a.T_session_submap[one.a].inverse() * a.T_session_submap[other.a];
  const Pose T_b_other = b.T_session_submap[one.b].inverse() * b.T_session_submap[other.b];
  const double way_m =
      std::abs(a.way_m[one.a] - a.way_m[other.a]) + std::abs(b.way_m[one.b] - b.way_m[other.b]);
  const Pose expected = T_a_other.inverse() * one.T_a_b * T_b_other;
  const Eigen::Vector3d off = expected.translation() - other.T_a_b.translation();
  return off.head<2>().norm() <= options.distance_m + options.drift * way_m &&
         std::abs(off.z()) <= options.height_m + options.height_drift * way_m &&
         std::abs(YawOf(expected.inverse() * other.T_a_b)) <=
             options.yaw_rad + options.yaw_drift_rad_a_m * way_m;
}

}  // namespace

bool AreConsistent(const Closure& one,
                   const Closure& other,
                   const SessionPair& sessions,
                   const ConsistencyOptions& options) {
  return Confirms(one, other, sessions, options) && Confirms(other, one, sessions, options);
}

std::vector<Indices> ConsistentSets(std::span<const Closure> closures,
                                    const SessionPair& sessions,
                                    const ConsistencyOptions& options,
                                    std::size_t most) {
  Indices left = Weightiest(closures, options.max_closures);
  const Agreement agree(closures, left, sessions, options);
  const std::vector<Weight> weights = WeightsOf(closures);
  std::vector<Indices> sets;
  while (sets.size() < most && !left.empty()) {
    Indices set = HeaviestSet(left, agree, weights);
    std::erase_if(left, [&](std::size_t i) {
      return std::any_of(set.begin(), set.end(),
                         [&](std::size_t j) { return i == j || agree(i, j); });
    });
    sets.push_back(std::move(set));
  }
  return sets;
}

double WeightOf(std::span<const Closure> closures, std::span<const std::size_t> set) {
  double weight = 0.0;
  for (const std::size_t i : set) {
    weight += closures[i].weight;
  }
  return weight;
}

}  // namespace atlas
