#include "tests/server/service/property/atlas_script.h"

#include <ostream>

namespace atlas::testing {
namespace {

const char* NameOf(StepKind kind) {
  switch (kind) {
    case StepKind::kUpload:
      return "upload";
    case StepKind::kUploadTwice:
      return "upload twice at once";
    case StepKind::kMovePoses:
      return "move poses";
    case StepKind::kChangeSession:
      return "change session";
    case StepKind::kCompact:
      return "compact";
    case StepKind::kAwaitAnswers:
      return "await answers";
    case StepKind::kCompare:
      return "compare";
    case StepKind::kNote:
      return "note";
    case StepKind::kReopen:
      return "reopen";
  }
  return "?";
}

const char* NameOf(SessionAction action) {
  switch (action) {
    case SessionAction::kRetract:
      return "retract";
    case SessionAction::kRestore:
      return "restore";
    case SessionAction::kRelease:
      return "release";
    case SessionAction::kPublish:
      return "publish";
    case SessionAction::kPurge:
      return "purge";
  }
  return "?";
}

std::ostream& operator<<(std::ostream& out, const Placing& placing) {
  const QuantizedPose& pose = placing.pose;
  out << "frame " << placing.frame;
  if (placing.content != 0) {
    out << " with content " << placing.content;
  }
  return out << " at (" << pose.x_um << ' ' << pose.y_um << ' ' << pose.z_um << ") um, quaternion "
             << pose.quaternion[0] << ' ' << pose.quaternion[1] << ' ' << pose.quaternion[2] << ' '
             << pose.quaternion[3];
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const DaemonSetup& setup) {
  return out << setup.workers << " workers, " << setup.tiles_per_claim
             << " tiles a claim, groups of " << setup.max_group << ", " << setup.max_readers
             << " readers, bytes: keyframes " << setup.building.keyframe_bytes << ", surveys "
             << setup.building.surveys.plain_bytes << " and packed "
             << setup.building.surveys.packed_bytes << " and on disk "
             << setup.building.survey_files.max_bytes << ", group " << setup.building.group_bytes;
}

std::ostream& operator<<(std::ostream& out, const Step& step) {
  out << NameOf(step.kind);
  for (const Placing& placing : step.placings) {
    out << "\n      " << placing;
  }
  if (step.kind == StepKind::kChangeSession) {
    out << ": " << NameOf(step.action) << ' ' << step.session;
  }
  if (step.kind == StepKind::kCompact) {
    out << " before " << step.before_ms << " ms";
  }
  if (step.kind == StepKind::kReopen) {
    out << ": " << step.setup;
  }
  return out;
}

std::ostream& operator<<(std::ostream& out, const AtlasScript& script) {
  const MapProfile& profile = script.profile;
  out << "preset " << FusionPresetName(profile.preset) << ", " << int{profile.levels} << " levels, "
      << int{profile.column_segments} << " segments of " << profile.segment_height_mm << " mm\n";
  for (std::size_t i = 0; i < script.frames.size(); ++i) {
    const ScriptFrame& frame = script.frames[i];
    out << "frame " << i << ": " << frame.key << ", radius "
        << frame.contents[0].keyframe->grid.radius_cells << ", time " << frame.contents[0].time_ms
        << " ms" << (frame.is_staged ? ", staged" : "") << '\n';
  }
  const PlausibilityLimits& limits = script.plausibility;
  out << "plausible: " << limits.max_speed_mps << " m/s and " << limits.max_jump_m << " m, "
      << limits.max_climb_mps << " m/s and " << limits.max_height_jump_m << " m up or down\n";
  out << "open: " << script.setup << '\n';
  for (std::size_t i = 0; i < script.steps.size(); ++i) {
    out << "step " << i << ": " << script.steps[i] << '\n';
  }
  return out;
}

}  // namespace atlas::testing
