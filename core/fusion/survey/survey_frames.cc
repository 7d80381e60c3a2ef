#include "core/fusion/survey/survey_frames.h"

#include <optional>

#include "core/fusion/survey/paper_survey.h"

namespace atlas {

Status SurveyFrames(std::span<const std::size_t> indices,
                    std::span<const FrameOnMap> frames,
                    const KeyframeSource& source,
                    const FusionContext& context,
                    StretchSurvey& survey) {
  std::optional<PaperSurvey> paper;
  if (context.profile.preset == FusionPreset::kPaper && !indices.empty()) {
    paper.emplace(survey.band(), context.sigmas, context.profile);
  }
  for (const std::size_t i : indices) {
    const auto keyframe = source(i);
    if (!keyframe) {
      return keyframe.error();
    }
    if (paper) {
      paper->Add(frames[i], **keyframe);
    } else {
      survey.Add(frames[i], **keyframe, context.sigmas);
    }
  }
  if (paper) {
    survey = paper->Finish();
  }
  return {};
}

}  // namespace atlas
