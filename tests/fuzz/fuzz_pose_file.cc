// Files of pose corrections (atlas poses apply).
#include "client/cli/files/pose_file.h"
#include "tests/fuzz/support/fuzz_target.h"

namespace atlas::fuzz {
namespace {

std::vector<Bytes> Seeds() {
  return {
      BytesOf("# corrected\n\ncar day 7 1 0 0 1.5 0 1 0 -2e3 0 0 1 0.25\n"
              "car day 8 0 -1 0 9999999 1 0 0 -1e7 0 0 1 19999\r\n")};
}

bool Run(ByteSpan text) {
  const auto corrections = ParsePoseFile(TextOf(text));
  for (const PoseCorrection& correction :
       corrections ? *corrections : std::vector<PoseCorrection>()) {
    Require(correction.key.Validate().ok(), "a corrected keyframe has a name");
    Require(correction.T_world_sensor.Validate().ok(), "a correction is a pose that is accepted");
  }
  return corrections.has_value();
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
