#include "tests/server/service/property/random_atlas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {
namespace {

constexpr double kDegree = 3.14159265358979323846 / 180.0;

class Drawing {
 public:
  explicit Drawing(std::uint32_t seed) : random_(seed) {}

  AtlasScript Draw() {
    DrawProfile();
    DrawFrames();
    DrawLimits();
    script_.setup = DrawSetup();
    DrawSteps();
    script_.is_verified = OneIn(16);
    return std::move(script_);
  }

 private:
  // Without <random>'s distributions: they differ between libraries. Draw once an expression, or in
  // braces: elsewhere the order of evaluation is the compiler's.
  std::uint32_t Below(std::uint32_t count) { return static_cast<std::uint32_t>(random_() % count); }
  bool OneIn(std::uint32_t count) { return Below(count) == 0; }
  double Unit() { return 2e-6 * Below(1'000'001) - 1.0; }  // -1 to 1
  template <typename T, std::size_t kSize>
  T OneOf(const std::array<T, kSize>& values) {
    return values[Below(kSize)];
  }

  void DrawProfile();
  void DrawFrames();
  void DrawLimits();
  void DrawSession(const SessionKey& key);
  Keyframe DrawKeyframe();
  FrameContent MakeContent(Keyframe keyframe, std::uint32_t sequence);
  DaemonSetup DrawSetup();
  Eigen::Quaterniond DrawTilt(double max_deg);
  QuantizedPose DrawPose(std::size_t frame);
  void DrawSteps();
  void AddUploads(std::uint32_t count);
  void AddMoves();
  void AddChange();
  void AddChance();

  std::mt19937 random_;
  AtlasScript script_;
  double centre_x_m_ = 0.0;
  double centre_y_m_ = 0.0;
  std::uint32_t decks_ = 1;
  double deck_height_m_ = 0.0;
  double unevenness_m_ = 0.0;  // of a deck
  // Most frames are the same scan at one of two places: a world that compactions thin out.
  bool is_repeated_ = false;
  std::optional<Keyframe> repeated_scan_;
  std::vector<QuantizedPose> repeated_poses_;
  std::vector<SessionKey> sessions_;
  std::vector<Eigen::Quaterniond> levels_;         // R_level_sensor of each frame
  std::vector<std::vector<QuantizedPose>> poses_;  // of each frame, as they were drawn
  std::vector<std::size_t> unsent_;                // frames, in the order of their first upload
  std::vector<std::size_t> sent_;
};

std::array<std::int32_t, 4> Quantized(const Eigen::Quaterniond& rotation) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation.toRotationMatrix();
  return QuantizedPose::FromPose(pose).quaternion;
}

void Drawing::DrawProfile() {
  MapProfile& profile = script_.profile;
  profile.tile_cells = OneIn(8) ? 32 : 16;  // 1.6 m; with 32 fusion may go in bands
  profile.levels = static_cast<std::uint8_t>(1 + Below(5));
  profile.column_segments = static_cast<std::uint8_t>(2u << Below(4));
  profile.segment_height_mm = OneIn(3) ? 1'000 : 500;
  profile.stretch_keyframes = 16;
  is_repeated_ = OneIn(3);
  profile.preset = is_repeated_ || OneIn(3) ? FusionPreset::kBounded
                   : OneIn(4)               ? FusionPreset::kPaper
                                            : FusionPreset::kStrict;
  profile.band_segments = static_cast<std::uint8_t>(1 + Below(is_repeated_ ? 2 : 4));
  profile.band_vehicle_segments = static_cast<std::uint8_t>(1 + Below(3));
  const std::array<double, 4> far_m{0.0, 0.8, -1'234.0, 1'600'000.0};
  centre_x_m_ = OneOf(far_m);
  centre_y_m_ = OneOf(far_m);
  decks_ = 1 + Below(4);
  const std::array<double, 3> heights_m{1.3, 2.6, 3.2};  // below, at and above PartReach()
  deck_height_m_ = OneOf(heights_m);
  unevenness_m_ = OneIn(2) ? 0.0 : 0.9;
}

void Drawing::DrawFrames() {
  const std::array<std::string, 5> names{"s1", "s10", "s2", "A", "a"};
  const std::uint32_t vehicles = 1 + Below(3);
  const std::uint32_t sessions = is_repeated_ ? 5 + Below(4) : 1 + Below(5);
  for (std::uint32_t i = 0; i < sessions; ++i) {
    const SessionKey key{"car" + std::to_string(Below(vehicles)), OneOf(names)};
    if (std::find(sessions_.begin(), sessions_.end(), key) == sessions_.end()) {
      sessions_.push_back(key);
      DrawSession(key);
    }
  }
  for (std::size_t i = 0; i < script_.frames.size(); ++i) {
    unsent_.push_back(i);
    std::swap(unsent_.back(), unsent_[Below(static_cast<std::uint32_t>(i + 1))]);
  }
}

// As a rule so that some sessions are quarantined now and then: frames are 3 m apart, and 0.5 s.
void Drawing::DrawLimits() {
  if (OneIn(3)) {
    return;
  }
  PlausibilityLimits& limits = script_.plausibility;
  limits.max_speed_mps = OneOf(std::array<double, 4>{0.0, 0.5, 3.0, 90.0});
  limits.max_jump_m = OneOf(std::array<double, 4>{0.5, 2.0, 4.0, 50.0});
  limits.max_climb_mps = OneOf(std::array<double, 3>{0.0, 0.5, 15.0});
  limits.max_height_jump_m = OneOf(std::array<double, 3>{0.5, 3.0, 20.0});
}

void Drawing::DrawSession(const SessionKey& key) {
  std::uint32_t sequence = Below(20);
  const std::uint32_t count = 1 + Below(8);
  const bool is_staged = OneIn(4);
  for (std::uint32_t i = 0; i < count; ++i) {
    ScriptFrame frame{{key, sequence}, is_staged, {}};
    levels_.push_back(DrawTilt(is_repeated_ ? 0.0 : 5.0));
    FrameContent& right = frame.contents[0];
    const bool is_again = repeated_scan_ && !OneIn(6);
    Keyframe scan = is_again ? *repeated_scan_ : DrawKeyframe();
    if (is_repeated_ && !repeated_scan_) {
      repeated_scan_ = scan;
    }
    right = MakeContent(std::move(scan), sequence);
    frame.contents[1] = MakeContent(DrawKeyframe(), sequence);
    frame.contents[1].time_ms = right.time_ms;
    frame.contents[2] = right;
    frame.contents[2].time_ms += 700;
    script_.frames.push_back(std::move(frame));
    poses_.emplace_back();
    sequence += OneIn(6) ? 40 : 1 + Below(6);
  }
}

// Grounds of 40 mm noise below the sensor and some far off, so that layers join, split and straddle
// the gates.
Keyframe Drawing::DrawKeyframe() {
  const auto radius = static_cast<std::int32_t>(6 + Below(15));
  Keyframe keyframe =
      RandomKeyframe(script_.profile, radius, static_cast<std::uint32_t>(random_()));
  for (KeyframeCell& cell : keyframe.cells) {
    if (cell.source != AltitudeSource::kNone) {
      cell.altitude_mm = static_cast<std::int16_t>(-1'700 + int(Below(OneIn(20) ? 5'000 : 40)));
    }
  }
  keyframe.level_quaternion = Quantized(levels_.back());
  return keyframe;
}

FrameContent Drawing::MakeContent(Keyframe keyframe, std::uint32_t sequence) {
  // Seconds are what tiles tell of times; they do not always follow the sequence.
  const std::int64_t time_ms = 5'000 + 500 * std::int64_t{sequence} - (OneIn(4) ? 3'000 : 0);
  FrameContent content{time_ms, nullptr, EncodeKeyframe(keyframe)};
  content.keyframe = std::make_shared<const Keyframe>(std::move(keyframe));
  return content;
}

DaemonSetup Drawing::DrawSetup() {
  constexpr std::size_t kMuch = std::size_t{64} << 20;
  DaemonSetup setup;
  setup.workers = 1 + Below(4);
  setup.tiles_per_claim = 1 + Below(6);
  setup.building.keyframe_bytes = OneOf(std::array<std::size_t, 3>{0, 30'000, kMuch});
  setup.building.surveys.plain_bytes = OneOf(std::array<std::size_t, 3>{0, 100'000, kMuch});
  setup.building.surveys.packed_bytes = OneOf(std::array<std::size_t, 3>{0, 50'000, kMuch});
  setup.building.surveys.idle = std::chrono::milliseconds(Below(2) == 0 ? 0 : 60'000);
  setup.building.survey_files.max_bytes = OneOf(std::array<std::size_t, 3>{0, 50'000, kMuch});
  setup.building.survey_files.min_free_bytes = 0;
  setup.building.group_bytes = OneOf(std::array<std::size_t, 4>{1, 100'000, kMuch, kMuch});
  setup.max_group = OneOf(std::array<std::size_t, 3>{1, 3, 64});
  setup.max_readers = 1 + Below(4);
  return setup;
}

Eigen::Quaterniond Drawing::DrawTilt(double max_deg) {
  const double angle_rad = max_deg * kDegree * Unit();
  const double direction_rad = 180.0 * kDegree * Unit();
  const Eigen::Vector3d axis(std::cos(direction_rad), std::sin(direction_rad), 0.0);
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}

// Near the others as a rule, on one of the decks, at times one that the frame had before.
QuantizedPose Drawing::DrawPose(std::size_t frame) {
  if (repeated_poses_.size() == 2 && !OneIn(6)) {
    return repeated_poses_[Below(2)];
  }
  std::vector<QuantizedPose>& before = poses_[frame];
  if (!before.empty() && OneIn(3)) {
    return before[Below(static_cast<std::uint32_t>(before.size()))];
  }
  const double away_m = OneIn(12) ? 9.0 : 0.0;
  const double deck_m = deck_height_m_ * Below(decks_) + unevenness_m_ * Unit();
  Pose T_world_sensor = Pose::Identity();
  T_world_sensor.translation() =
      Eigen::Vector3d{centre_x_m_ + away_m + 1.5 * Unit(), centre_y_m_ + 1.5 * Unit(), deck_m};
  const Eigen::Quaterniond yaw(
      Eigen::AngleAxisd(180.0 * kDegree * Unit(), Eigen::Vector3d::UnitZ()));
  const Eigen::Quaterniond tilt = DrawTilt(1.5);
  T_world_sensor.linear() = (yaw * tilt * levels_[frame]).toRotationMatrix();
  before.push_back(QuantizedPose::FromPose(T_world_sensor));
  if (is_repeated_ && repeated_poses_.size() < 2) {
    repeated_poses_.push_back(before.back());
  }
  return before.back();
}

void Drawing::AddUploads(std::uint32_t count) {
  Step step;
  step.kind = OneIn(5) ? StepKind::kUploadTwice : StepKind::kUpload;
  for (std::uint32_t i = 0; i < count; ++i) {
    const bool is_again = !sent_.empty() && OneIn(5);
    if (!is_again && unsent_.empty()) {
      break;
    }
    Placing placing;
    if (is_again) {
      placing.frame = sent_[Below(static_cast<std::uint32_t>(sent_.size()))];
      placing.content = OneIn(2) ? 0 : 1 + Below(2);
    } else {
      placing.frame = unsent_.back();
      unsent_.pop_back();
      sent_.push_back(placing.frame);
    }
    const bool is_there =
        std::any_of(step.placings.begin(), step.placings.end(),
                    [&placing](const Placing& other) { return other.frame == placing.frame; });
    if (is_there && step.kind == StepKind::kUploadTwice) {
      continue;  // which of two is first must not matter
    }
    placing.pose = DrawPose(placing.frame);
    step.placings.push_back(placing);
  }
  script_.steps.push_back(std::move(step));
}

void Drawing::AddMoves() {
  Step step;
  step.kind = StepKind::kMovePoses;
  const std::uint32_t count = OneIn(2) ? 1 : 1 + Below(6);
  for (std::uint32_t i = 0; i < count && !sent_.empty(); ++i) {
    Placing placing;
    // One that is not there, or twice in the batch: the whole batch is refused.
    placing.frame = !unsent_.empty() && OneIn(20)
                        ? unsent_.back()
                        : sent_[Below(static_cast<std::uint32_t>(sent_.size()))];
    const bool is_there =
        std::any_of(step.placings.begin(), step.placings.end(),
                    [&placing](const Placing& other) { return other.frame == placing.frame; });
    if (!is_there || OneIn(8)) {
      placing.pose = DrawPose(placing.frame);
      step.placings.push_back(placing);
    }
  }
  script_.steps.push_back(std::move(step));
}

void Drawing::AddChange() {
  Step step;
  step.kind = StepKind::kChangeSession;
  step.session = sessions_[Below(static_cast<std::uint32_t>(sessions_.size()))];
  const std::uint32_t chance = Below(20);
  step.action = chance < 6    ? SessionAction::kRetract
                : chance < 12 ? SessionAction::kRestore
                : chance < 15 ? SessionAction::kRelease
                : chance < 19 ? SessionAction::kPublish
                              : SessionAction::kPurge;
  script_.steps.push_back(step);
  if (OneIn(4)) {
    script_.steps.push_back(std::move(step));
  }
}

void Drawing::AddChance() {
  Step step;
  const std::uint32_t chance = Below(100);
  if (chance < 40) {
    AddUploads(1 + Below(5));
  } else if (chance < 62) {
    AddMoves();
  } else if (chance < 76) {
    AddChange();
  } else if (chance < 88) {
    step.kind = StepKind::kAwaitAnswers;
    script_.steps.push_back(std::move(step));
  } else if (chance < 92) {
    step.kind = StepKind::kCompact;
    step.before_ms = OneIn(2) ? 1'000'000 : 5'000 + 500 * std::int64_t{Below(40)};
    script_.steps.push_back(std::move(step));
  } else if (chance < 96) {
    step.kind = StepKind::kCompare;
    script_.steps.push_back(std::move(step));
  } else {
    step.kind = StepKind::kReopen;
    step.setup = DrawSetup();
    script_.steps.push_back(std::move(step));
  }
}

void Drawing::DrawSteps() {
  AddUploads(1 + Below(4));
  const std::uint32_t count = 6 + Below(18);
  const std::uint32_t noted = OneIn(4) ? Below(count) : count;
  for (std::uint32_t i = 0; i < count; ++i) {
    AddChance();
    if (i == noted) {
      Step step;
      step.kind = StepKind::kNote;
      script_.steps.push_back(std::move(step));
    }
  }
  script_.steps.emplace_back();  // compare
}

}  // namespace

AtlasScript RandomAtlas(std::uint32_t seed) {
  return Drawing(seed).Draw();
}

}  // namespace atlas::testing
