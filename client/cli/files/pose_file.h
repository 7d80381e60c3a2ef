// Files of pose corrections: one a line, "vehicle session sequence" and 12 numbers, 3x4 row-major,
// sensor to world. Blank lines and lines that start with # are skipped.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/connection/requests.h"
#include "core/base/status.h"

namespace atlas {

// kInvalidData with the line's number: a line of another form, a name that is none, a pose that is
// none, a keyframe named twice, no pose at all.
Result<std::vector<PoseCorrection>> ParsePoseFile(std::string_view text);

// A file that reads back as these, to the micrometre.
std::string PoseFileText(std::span<const PoseCorrection> corrections);

}  // namespace atlas
