#include "core/fusion/frame_needs.h"

#include <algorithm>
#include <cassert>
#include <utility>

#include "core/fusion/combination/bounded_choice.h"
#include "core/fusion/survey/band_surveys.h"

namespace atlas {
namespace {

class NeedFinder {
 public:
  NeedFinder(std::span<const FrameOnMap> frames,
             const KeyframeSource& source,
             const MapProfile& profile)
      : frames_(frames),
        source_(source),
        profile_(profile),
        sigmas_(profile, MaxRadiusCells(frames)),
        choice_(profile),
        is_asked_(frames.size(), false),
        is_needed_(frames.size(), false) {}

  void Ask(std::size_t frame) { is_asked_[frame] = true; }
  bool HasOpen(const FusionStretch& stretch) const {
    return std::any_of(stretch.frames.begin(), stretch.frames.end(),
                       [this](std::size_t i) { return IsOpen(i); });
  }

  Status FindInBand(const TileBand& band, std::span<const FusionStretch> stretches) {
    auto surveys = BandSurveys::Survey(band, stretches, frames_, source_, {profile_, sigmas_});
    if (!surveys) {
      return surveys.error();
    }
    MarkWhatCounts(*surveys);
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      if (HasOpen(stretches[i])) {
        ATLAS_RETURN_IF_ERROR(FollowFrames(stretches[i], surveys->surveys()[i]));
      }
    }
    return {};
  }

  std::vector<std::size_t> Needed() const {
    std::vector<std::size_t> needed;
    for (std::size_t i = 0; i < is_needed_.size(); ++i) {
      if (is_needed_[i]) {
        needed.push_back(i);
      }
    }
    return needed;
  }

 private:
  bool IsOpen(std::size_t frame) const { return is_asked_[frame] && !is_needed_[frame]; }

  // As `is_used` of the segments.
  void MarkWhatCounts(BandSurveys& surveys) {
    for (std::size_t cell = 0; cell < surveys.cells(); ++cell) {
      surveys.Collect(cell, segments_);
      const std::size_t counting = choice_.MoveLatestToFront(segments_);
      for (const SegmentView& view : std::span(segments_).first(counting)) {
        view.segment->is_used = true;
      }
    }
  }

  // Surveys the stretch a second time: its segments get the numbers that they had in `first`, and
  // those that a frame saw last once it was added are those that it spoke to.
  Status FollowFrames(const FusionStretch& stretch, StretchSurvey& first) {
    StretchSurvey again(first.band(), profile_);
    for (std::uint32_t n = 0; n < stretch.frames.size(); ++n) {
      const std::size_t frame = stretch.frames[n];
      const auto keyframe = source_(frame);
      if (!keyframe) {
        return keyframe.error();
      }
      again.ClearTouched();
      again.Add(frames_[frame], **keyframe, sigmas_);
      if (IsOpen(frame)) {
        is_needed_[frame] = SpokeToWhatCounts(again, n, first);
      }
    }
    return {};
  }

  bool SpokeToWhatCounts(StretchSurvey& again, std::uint32_t frame, StretchSurvey& first) const {
    const std::size_t cells = static_cast<std::size_t>(again.band().rows) * profile_.tile_cells;
    for (std::size_t cell = 0; cell < cells; ++cell) {
      if (!again.touched().Contains(cell)) {
        continue;
      }
      for (std::uint32_t k = again.First(cell); k != Segment::kNone; k = again.At(k).next) {
        if (again.At(k).last_frame == frame && first.At(k).is_used) {
          return true;
        }
      }
    }
    return false;
  }

  std::span<const FrameOnMap> frames_;
  const KeyframeSource& source_;
  const MapProfile& profile_;
  SigmaTable sigmas_;
  BoundedChoice choice_;
  std::vector<bool> is_asked_;   // by frame
  std::vector<bool> is_needed_;  // by frame
  std::vector<SegmentView> segments_;
};

}  // namespace

Result<std::vector<std::size_t>> FindNeededFrames(
    const TileId& id,
    std::span<const FrameOnMap> frames,
    const std::function<bool(std::size_t index)>& is_asked,
    const KeyframeSource& source,
    const MapProfile& profile,
    std::size_t max_bytes) {
  assert(id.level == 0 && profile.preset == FusionPreset::kBounded);
  NeedFinder finder(frames, source, profile);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (is_asked(i)) {
      finder.Ask(i);
    }
  }
  const std::vector<FusionStretch> stretches = CutStretches(id, frames, profile);
  const auto is_open = [&] {
    return std::any_of(stretches.begin(), stretches.end(),
                       [&](const FusionStretch& s) { return finder.HasOpen(s); });
  };
  const std::int32_t side = profile.tile_cells;
  const std::int32_t rows = stretches.empty() ? side : RowsWithin(max_bytes, stretches, profile);
  for (std::int32_t first = 0; first < side && is_open(); first += rows) {
    const TileBand band{id, first, std::min(rows, side - first)};
    if (Status status = finder.FindInBand(band, stretches); !status.ok()) {
      return Error(std::move(status));
    }
  }
  return finder.Needed();
}

}  // namespace atlas
