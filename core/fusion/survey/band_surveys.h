// What every stretch of a tile saw of a band of it, to be looked at cell by cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/fusion/fusion_context.h"
#include "core/fusion/observation/frame_on_map.h"
#include "core/fusion/segment/segment_view.h"
#include "core/fusion/survey/fusion_stretch.h"
#include "core/fusion/survey/stretch_survey.h"

namespace atlas {

// The largest radius of a frame's grid, at least 1: what a SigmaTable must reach.
std::int32_t MaxRadiusCells(std::span<const FrameOnMap> frames);

// How many rows of a tile can be surveyed at once within about `max_bytes`, at least one.
std::int32_t RowsWithin(std::size_t max_bytes,
                        std::span<const FusionStretch> stretches,
                        const MapProfile& profile);

class BandSurveys {
 public:
  // `stretches` of `frames`; each keyframe is asked of `source` once. All but the context's profile
  // must outlive the surveys. Errors are the source's.
  static Result<BandSurveys> Survey(const TileBand& band,
                                    std::span<const FusionStretch> stretches,
                                    std::span<const FrameOnMap> frames,
                                    const KeyframeSource& source,
                                    const FusionContext& context);

  std::size_t cells() const { return cells_; }
  // By their place among the stretches.
  std::span<StretchSurvey> surveys() { return surveys_; }
  // Makes `segments` those of a cell (row by row from the band's first), in canonical order.
  void Collect(std::size_t cell, std::vector<SegmentView>& segments);

 private:
  BandSurveys(std::span<const FusionStretch> stretches, std::size_t cells)
      : stretches_(stretches), cells_(cells) {}

  std::span<const FusionStretch> stretches_;
  std::vector<StretchSurvey> surveys_;
  std::size_t cells_ = 0;
};

}  // namespace atlas
