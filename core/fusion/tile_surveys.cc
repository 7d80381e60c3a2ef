#include "core/fusion/tile_surveys.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "core/fusion/survey_frames.h"
#include "core/fusion/tile_combiner.h"

namespace atlas {

TileSurveys::Surveyed TileSurveys::Describe(const FrameOnMap& frame) {
  return {frame.key.sequence, frame.grid.radius_cells, frame.time_ms, frame.content,
          frame.placement};
}

Result<TileSurveys::Work> TileSurveys::Update(std::span<const FrameOnMap> frames,
                                              const KeyframeSource& source,
                                              const FusionContext& context) {
  Work work;
  std::vector<Stretch> updated;
  for (const FusionStretch& wanted : CutStretches(id_, frames, context.profile)) {
    std::vector<Surveyed> described;
    for (const std::size_t i : wanted.frames) {
      described.push_back(Describe(frames[i]));
    }
    Stretch stretch = TakeStretch(wanted, described, context.profile);
    const std::size_t kept = stretch.frames.size();
    const std::span rest = std::span(wanted.frames).subspan(kept);
    if (Status status = SurveyFrames(rest, frames, source, context, stretch.survey); !status.ok()) {
      return Error(std::move(status));
    }
    work.kept += kept;
    work.surveyed += rest.size();
    stretch.frames = std::move(described);
    updated.push_back(std::move(stretch));
  }
  stretches_ = std::move(updated);
  return work;
}

// The stretch as it was, if what it has surveyed is how `frames` begin; else one without frames.
TileSurveys::Stretch TileSurveys::TakeStretch(const FusionStretch& wanted,
                                              std::span<const Surveyed> frames,
                                              const MapProfile& profile) {
  const auto found = std::lower_bound(
      stretches_.begin(), stretches_.end(), wanted, [](const Stretch& a, const FusionStretch& b) {
        return std::tie(a.key, a.number) < std::tie(*b.key, b.number);
      });
  const bool is_there =
      found != stretches_.end() && found->key == *wanted.key && found->number == wanted.number;
  // Equation 2 to the letter needs all observations of a session at once.
  const bool can_grow = profile.preset != FusionPreset::kPaper;
  const bool is_beginning = is_there && found->frames.size() <= frames.size() &&
                            (can_grow || found->frames.size() == frames.size()) &&
                            std::equal(found->frames.begin(), found->frames.end(), frames.begin());
  Stretch stretch{
      *wanted.key,
      wanted.number,
      wanted.session,
      wanted.vehicle,
      {},
      is_beginning ? std::move(found->survey) : StretchSurvey(WholeTile(profile), profile)};
  if (is_beginning) {
    stretch.frames = found->frames;
  }
  return stretch;
}

Tile TileSurveys::Combine(const FusionContext& context) const {
  Tile tile = EmptyTile(id_, context.profile);
  if (stretches_.empty()) {
    return tile;
  }
  std::vector<SurveyedStretch> surveyed;
  for (const Stretch& stretch : stretches_) {
    surveyed.push_back({&stretch.survey, stretch.session, stretch.vehicle});
  }
  TileCombiner combiner(context.sigmas, context.profile,
                        std::size_t{stretches_.back().session} + 1);
  combiner.Combine(WholeTile(context.profile), surveyed, tile);
  for (const Stretch& stretch : stretches_) {
    const bool is_new = tile.contributors.empty() || tile.contributors.back() != stretch.key;
    if (combiner.contributed()[stretch.session] && is_new) {
      tile.contributors.push_back(stretch.key);
    }
  }
  return tile;
}

std::size_t TileSurveys::bytes() const {
  std::size_t bytes = sizeof(*this);
  for (const Stretch& stretch : stretches_) {
    bytes +=
        sizeof(Stretch) + stretch.frames.capacity() * sizeof(Surveyed) + stretch.survey.bytes();
  }
  return bytes;
}

void TileSurveys::Pack() {
  for (Stretch& stretch : stretches_) {
    stretch.survey.Pack();
  }
}

void TileSurveys::Unpack() {
  for (Stretch& stretch : stretches_) {
    stretch.survey.Unpack();
  }
}

}  // namespace atlas
