#include "tests/server/service/property/rising_atlas.h"

#include <memory>
#include <random>
#include <utility>

#include "core/keyframe/keyframe_codec.h"
#include "tests/core/support/keyframe_worlds.h"

namespace atlas::testing {
namespace {

class Drawing {
 public:
  explicit Drawing(std::uint32_t seed) : random_(seed) {}

  AtlasScript Draw() {
    MapProfile& profile = script_.profile;
    profile.tile_cells = 16;
    profile.levels = static_cast<std::uint8_t>(1 + Below(3));
    profile.stretch_keyframes = Below(4) == 0 ? 16 : 256;
    profile.preset = Below(2) == 0 ? FusionPreset::kBounded : FusionPreset::kStrict;
    script_.setup.workers = 1 + Below(2);
    const double step_m = Between(0.3, 0.6);
    See("deck", {0.8, 0.8, Between(8.0, 14.0)}, true);
    for (int i = 0; i < 14; ++i) {
      See("rising", {1.5 - 0.1 * i, 0.8, step_m * i}, true);
      const double x_m = Between(0.0, 1.6);
      const double y_m = Between(0.0, 1.6);
      See("guessing", {x_m, y_m, Between(-1.0, 5.0)}, false);
      if (Below(6) == 0) {
        Correct();
      }
    }
    script_.steps.emplace_back();  // compare
    return std::move(script_);
  }

 private:
  // Without <random>'s distributions: they differ between libraries. Draw once an expression.
  std::uint32_t Below(std::uint32_t count) { return static_cast<std::uint32_t>(random_() % count); }
  double Between(double low, double high) { return low + 1e-3 * (high - low) * Below(1'001); }

  static QuantizedPose Level(const MapPose& at) {
    Pose T_world_sensor = Pose::Identity();
    T_world_sensor.translation() = Eigen::Vector3d(at.x_m, at.y_m, at.z_m);
    return QuantizedPose::FromPose(T_world_sensor);
  }

  // Uploads another keyframe of a session.
  void See(const char* session, const MapPose& at, bool is_street) {
    const auto number = static_cast<std::uint32_t>(script_.frames.size());
    Keyframe keyframe = is_street ? StreetKeyframe(script_.profile, 16, 1)
                                  : RandomKeyframe(script_.profile, 16, number);
    FrameContent content{100 * std::int64_t{number}, nullptr, EncodeKeyframe(keyframe)};
    content.keyframe = std::make_shared<const Keyframe>(std::move(keyframe));
    script_.frames.push_back({{{"car", session}, number}, false, {content, content, content}});
    poses_.push_back(Level(at));
    Add(StepKind::kUpload, {number, poses_.back(), 0});
    Add(StepKind::kAwaitAnswers, {});
    if (Below(8) != 0) {
      script_.steps.emplace_back();  // compare
    }
  }

  // Moves one that was sent up or down.
  void Correct() {
    const std::uint32_t number = Below(static_cast<std::uint32_t>(poses_.size()));
    poses_[number].z_um += static_cast<std::int64_t>(1e6 * Between(-0.5, 0.5));
    Add(StepKind::kMovePoses, {number, poses_[number], 0});
    script_.steps.emplace_back();  // compare
  }

  void Add(StepKind kind, const Placing& placing) {
    Step step;
    step.kind = kind;
    if (kind != StepKind::kAwaitAnswers) {
      step.placings.push_back(placing);
    }
    script_.steps.push_back(std::move(step));
  }

  std::mt19937 random_;
  AtlasScript script_;
  std::vector<QuantizedPose> poses_;  // of each frame
};

}  // namespace

AtlasScript RisingAtlas(std::uint32_t seed) {
  return Drawing(seed).Draw();
}

}  // namespace atlas::testing
