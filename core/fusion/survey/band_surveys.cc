#include "core/fusion/survey/band_surveys.h"

#include <algorithm>
#include <utility>

#include "core/fusion/survey/survey_frames.h"

namespace atlas {

std::int32_t MaxRadiusCells(std::span<const FrameOnMap> frames) {
  std::int32_t radius = 1;
  for (const FrameOnMap& frame : frames) {
    radius = std::max(radius, frame.grid.radius_cells);
  }
  return radius;
}

// Where most cells have a segment or two of each stretch; in preset paper all observations are kept
// for a while.
std::int32_t RowsWithin(std::size_t max_bytes,
                        std::span<const FusionStretch> stretches,
                        const MapProfile& profile) {
  constexpr std::size_t kCellBytes = 128;        // of a stretch
  constexpr std::size_t kObservationBytes = 48;  // preset paper
  std::size_t longest = 0;
  for (const FusionStretch& stretch : stretches) {
    longest = std::max(longest, stretch.frames.size());
  }
  const std::size_t cell_bytes =
      stretches.size() * kCellBytes +
      (profile.preset == FusionPreset::kPaper ? longest * kObservationBytes : 0);
  return static_cast<std::int32_t>(std::clamp<std::size_t>(
      max_bytes / (cell_bytes * profile.tile_cells), std::size_t{1}, profile.tile_cells));
}

Result<BandSurveys> BandSurveys::Survey(const TileBand& band,
                                        std::span<const FusionStretch> stretches,
                                        std::span<const FrameOnMap> frames,
                                        const KeyframeSource& source,
                                        const FusionContext& context) {
  const std::size_t side = context.profile.tile_cells;
  BandSurveys surveys(stretches, static_cast<std::size_t>(band.rows) * side);
  surveys.surveys_.reserve(stretches.size());
  for (const FusionStretch& stretch : stretches) {
    StretchSurvey& survey = surveys.surveys_.emplace_back(band, context.profile);
    Status status = SurveyFrames(stretch.frames, frames, source, context, survey);
    if (!status.ok()) {
      return Error(std::move(status));
    }
  }
  return surveys;
}

void BandSurveys::Collect(std::size_t cell, std::vector<SegmentView>& segments) {
  segments.clear();
  for (std::uint32_t i = 0; i < surveys_.size(); ++i) {
    StretchSurvey& survey = surveys_[i];
    for (std::uint32_t k = survey.First(cell); k != Segment::kNone; k = survey.At(k).next) {
      Segment& segment = survey.At(k);
      const auto time_ms = [&](std::uint32_t frame) {
        return survey.frames()[frame].time_ms;
      };
      segments.push_back(
          {.segment = &segment,
           .last_time_ms = time_ms(segment.last_frame),
           .driven_ms = segment.driven_frame == Segment::kNone ? 0 : time_ms(segment.driven_frame),
           .stretch = i,
           .session = stretches_[i].session,
           .vehicle = stretches_[i].vehicle});
    }
  }
}

}  // namespace atlas
