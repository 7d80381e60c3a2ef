#include "core/fusion/survey/paper_survey.h"

#include <algorithm>
#include <cstdlib>

namespace atlas {
namespace {

std::int64_t Difference(const Observation& a, const Observation& b) {
  return std::abs(std::int64_t{a.altitude_mm} - b.altitude_mm);
}

}  // namespace

void PaperSurvey::Add(const FrameOnMap& frame, const Keyframe& keyframe) {
  const auto number = static_cast<std::uint32_t>(frames_.size());
  frames_.push_back({frame.key.sequence, frame.time_ms});
  FrameResampler(frame, keyframe, sigmas_, profile_)
      .Visit(
          band_, [](std::size_t) {},
          [&](std::size_t cell, const Observation& observation) {
            seen_.push_back({cell, number, observation});
          });
}

StretchSurvey PaperSurvey::Finish() {
  std::stable_sort(seen_.begin(), seen_.end(),
                   [](const Seen& a, const Seen& b) { return a.cell < b.cell; });
  StretchSurvey survey(band_, profile_);
  for (const StretchFrame& frame : frames_) {
    survey.AddFrame(frame);
  }
  std::size_t begin = 0;
  for (std::size_t i = 1; i <= seen_.size(); ++i) {
    if (i == seen_.size() || seen_[i].cell != seen_[begin].cell) {
      SurveyCell(std::span(seen_).subspan(begin, i - begin), survey);
      begin = i;
    }
  }
  return survey;
}

void PaperSurvey::FindRuns(std::span<const Seen> cell) {
  runs_.clear();
  for (std::size_t i = 0; i < cell.size(); ++i) {
    const bool starts =
        i == 0 || frames_[cell[i].frame].sequence - frames_[cell[i - 1].frame].sequence >
                      profile_.sequence_gap;
    if (starts) {
      runs_.push_back({i, 0});
    } else if (cell[i].observation.distance_step <
               cell[runs_.back().representative].observation.distance_step) {
      runs_.back().representative = i;  // of two equally near ones the first stays
    }
  }
}

// Eq. 2: the last representative before or at the observation or the first one after it, whichever
// is closer in altitude. `run` is the one that the observation before it was compared from.
std::size_t PaperSurvey::RunOf(std::span<const Seen> cell,
                               std::size_t index,
                               std::size_t run) const {
  const std::size_t before = runs_[run].representative;
  if (index < before || run + 1 == runs_.size()) {
    return run;
  }
  const Observation& observation = cell[index].observation;
  const std::size_t after = runs_[run + 1].representative;
  const bool after_is_closer = Difference(cell[after].observation, observation) <
                               Difference(cell[before].observation, observation);
  return after_is_closer ? run + 1 : run;
}

void PaperSurvey::SurveyCell(std::span<const Seen> cell, StretchSurvey& survey) {
  FindRuns(cell);
  for (Run& run : runs_) {
    run.segment = survey.AddSegment(cell[0].cell, cell[run.representative].observation, false);
  }
  std::size_t run = 0;
  for (std::size_t i = 0; i < cell.size(); ++i) {
    while (run + 1 < runs_.size() && runs_[run + 1].representative <= i) {
      ++run;
    }
    const Observation& observation = cell[i].observation;
    survey.AddEvidence(observation, sigmas_.Weight(observation.source, observation.distance_step),
                       cell[i].frame, runs_[RunOf(cell, i, run)].segment);
  }
}

}  // namespace atlas
