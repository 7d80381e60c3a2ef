// How well ground was told from the rest, against SemanticKITTI labels (docs/results.md has the
// protocol).
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

namespace atlas {

// Of one scan.
struct SegmentationCounts {
  std::uint64_t true_ground = 0;   // called ground, is ground
  std::uint64_t false_ground = 0;  // called ground, is not
  std::uint64_t missed_ground = 0;

  double precision() const;
  double recall() const;
  double f1() const;
};

// Means over scans.
class SegmentationScore {
 public:
  void Add(const SegmentationCounts& counts);

  std::uint64_t scans() const { return scans_; }
  double precision() const { return Mean(precision_sum_); }
  double recall() const { return Mean(recall_sum_); }
  double f1() const { return Mean(f1_sum_); }

 private:
  double Mean(double sum) const { return scans_ == 0 ? 0.0 : sum / static_cast<double>(scans_); }

  std::uint64_t scans_ = 0;
  double precision_sum_ = 0.0;
  double recall_sum_ = 0.0;
  double f1_sum_ = 0.0;
};

// Counts one return: ground is road, parking, sidewalk, other ground, lane marking and terrain;
// unlabelled, outlier and vegetation are ignored, and so are returns outside of 2.7 to 80 m.
void CountReturn(const Eigen::Vector3f& p_sensor,
                 std::uint32_t label,
                 bool is_called_ground,
                 SegmentationCounts& counts);

}  // namespace atlas
