// A stretch's keyframes, or the last of them, into its survey.
#pragma once

#include <cstddef>
#include <span>

#include "core/fusion/fusion_context.h"
#include "core/fusion/observation/frame_on_map.h"
#include "core/fusion/survey/stretch_survey.h"

namespace atlas {

// Adds the frames of `indices` (by sequence), each asked of `source` when its turn comes, to
// `survey`; in preset paper these must be all of the session's. Errors are the source's.
Status SurveyFrames(std::span<const std::size_t> indices,
                    std::span<const FrameOnMap> frames,
                    const KeyframeSource& source,
                    const FusionContext& context,
                    StretchSurvey& survey);

}  // namespace atlas
