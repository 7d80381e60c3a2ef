#include "client/score/segmentation_score.h"

namespace atlas {
namespace {

constexpr float kMinRange_m = 2.7F;
constexpr float kMaxRange_m = 80.0F;

enum class Truth { kGround, kOther, kIgnored };

Truth TruthOf(std::uint32_t label) {
  switch (label & 0xFFFFU) {
    case 40:  // road
    case 44:  // parking
    case 48:  // sidewalk
    case 49:  // other ground
    case 60:  // lane marking
    case 72:  // terrain
      return Truth::kGround;
    case 0:   // unlabelled
    case 1:   // outlier
    case 70:  // vegetation
      return Truth::kIgnored;
    default:
      return Truth::kOther;
  }
}

double Ratio(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

double SegmentationCounts::precision() const {
  return Ratio(true_ground, true_ground + false_ground);
}

double SegmentationCounts::recall() const {
  return Ratio(true_ground, true_ground + missed_ground);
}

double SegmentationCounts::f1() const {
  return Ratio(2 * true_ground, 2 * true_ground + false_ground + missed_ground);
}

void SegmentationScore::Add(const SegmentationCounts& counts) {
  ++scans_;
  precision_sum_ += counts.precision();
  recall_sum_ += counts.recall();
  f1_sum_ += counts.f1();
}

void CountReturn(const Eigen::Vector3f& p_sensor,
                 std::uint32_t label,
                 bool is_called_ground,
                 SegmentationCounts& counts) {
  const float range_m = p_sensor.norm();
  const Truth truth = TruthOf(label);
  if (truth == Truth::kIgnored || range_m < kMinRange_m || range_m > kMaxRange_m) return;
  if (truth == Truth::kGround) {
    ++(is_called_ground ? counts.true_ground : counts.missed_ground);
  } else if (is_called_ground) {
    ++counts.false_ground;
  }
}

}  // namespace atlas
