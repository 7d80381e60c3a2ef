// A session's survey by the paper's words (III-C), for preset paper: segments are runs of keyframes
// that see the cell, whatever they see there, and each observation takes the label that eq. 2 gives
// it. Keeps all observations until the end.
#pragma once

#include <cstdint>
#include <vector>

#include "core/fusion/survey/stretch_survey.h"

namespace atlas {

class PaperSurvey {
 public:
  // Both must outlive it.
  PaperSurvey(const TileBand& band, const SigmaTable& sigmas, const MapProfile& profile)
      : band_(band), sigmas_(sigmas), profile_(profile) {}

  // Sequence numbers must rise from call to call.
  void Add(const FrameOnMap& frame, const Keyframe& keyframe);
  StretchSurvey Finish();

 private:
  struct Seen {
    std::size_t cell = 0;
    std::uint32_t frame = 0;
    Observation observation;
  };
  // A run with the index of its nearest observation among those of the cell.
  struct Run {
    std::size_t representative = 0;
    std::uint32_t segment = 0;
  };

  void FindRuns(std::span<const Seen> cell);
  std::size_t RunOf(std::span<const Seen> cell, std::size_t index, std::size_t run) const;
  void SurveyCell(std::span<const Seen> cell, StretchSurvey& survey);

  TileBand band_;
  const SigmaTable& sigmas_;
  const MapProfile& profile_;
  std::vector<StretchFrame> frames_;
  std::vector<Seen> seen_;
  std::vector<Run> runs_;
};

}  // namespace atlas
