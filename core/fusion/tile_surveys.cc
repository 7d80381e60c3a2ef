#include "core/fusion/tile_surveys.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "core/base/small_sort.h"

namespace atlas {
namespace {

// A stretch settles when its session went on with another one; when the tile was fused this often
// without it; or when it is this much older than the latest, a visit that is over, and the tile was
// fused a few times without it.
constexpr std::uint32_t kOpenFusions = 16;
constexpr std::int64_t kVisitMs = 60'000;
constexpr std::uint32_t kVisitFusions = 2;

void SortByStretch(std::vector<SegmentView>& segments) {
  const auto is_before = [](const SegmentView& a, const SegmentView& b) {
    return a.stretch < b.stretch;
  };
  SmallStableSort(segments.begin(), segments.end(), is_before);
}

}  // namespace

std::vector<FrameOnMap> TileSurveys::Expect(const TileChange& change,
                                            const FusionContext& context) {
  const MapProfile& profile = context.profile;
  assert(profile.preset != FusionPreset::kPaper);
  ++expected_count_;
  if (tile_.cell_begin.empty()) {
    tile_ = EmptyTile(id_, profile);
    touched_ = CellSet(tile_.cell_begin.size() - 1);
    touched_.Fill();
  }
  std::vector<PlannedStretch> wanted = Plan(change, profile);
  SurveyForgottenAgain(wanted);
  TakeStretches(wanted, profile);
  Settle(profile);

  std::vector<FrameOnMap> expected;
  open_.clear();
  awaited_.clear();
  for (std::uint32_t i = 0; i < stretches_.size(); ++i) {
    const Stretch& stretch = stretches_[i];
    if (stretch.open) {
      open_.push_back(i);
    }
    for (const StretchMember& frame : std::span(stretch.frames).subspan(wanted[i].kept)) {
      expected.push_back({{stretch.key, frame.sequence},
                          frame.time_ms,
                          frame.placement,
                          {profile.cell_size_um, frame.radius_cells},
                          frame.content});
      awaited_.push_back(i);
    }
  }
  std::reverse(awaited_.begin(), awaited_.end());
  return expected;
}

void TileSurveys::Add(const FrameOnMap& frame,
                      const Keyframe& keyframe,
                      const FusionContext& context) {
  stretches_[awaited_.back()].open->Add(frame, keyframe, context.sigmas);
  awaited_.pop_back();
}

std::vector<PlannedStretch> TileSurveys::Plan(const TileChange& change, const MapProfile& profile) {
  std::vector<PlannedStretch> plan;
  plan.reserve(stretches_.size() + 1);
  for (std::uint32_t i = 0; i < stretches_.size(); ++i) {
    Stretch& stretch = stretches_[i];
    const std::size_t surveyed = stretch.frames.size();
    plan.push_back({stretch.key, stretch.number, std::move(stretch.frames), i, surveyed});
  }
  ApplyChange(change, id_, profile, plan);
  return plan;
}

// What was forgotten did not count beside the settled segments as they were: where those change,
// all that was forgotten is surveyed again.
void TileSurveys::SurveyForgottenAgain(std::span<PlannedStretch> wanted) const {
  std::size_t unchanged = 0;
  for (const PlannedStretch& w : wanted) {
    unchanged +=
        w.old != PlannedStretch::kNone && !stretches_[w.old].open && w.kept == w.frames.size() ? 1u
                                                                                               : 0u;
  }
  const auto settled =
      std::count_if(stretches_.begin(), stretches_.end(), [](const Stretch& s) { return !s.open; });
  if (unchanged == static_cast<std::size_t>(settled)) {
    return;
  }
  for (PlannedStretch& w : wanted) {
    if (w.old != PlannedStretch::kNone && stretches_[w.old].has_forgotten) {
      w.StartOver();
    }
  }
}

void TileSurveys::TakeStretches(std::span<PlannedStretch> wanted, const MapProfile& profile) {
  const TileBand whole{id_, 0, profile.tile_cells};
  std::vector<std::uint32_t> settled_numbers(stretches_.size(), SettledSegments::kGone);
  std::vector<Stretch> next;
  for (std::uint32_t i = 0; i < wanted.size(); ++i) {
    PlannedStretch& w = wanted[i];
    const bool grows = w.kept < w.frames.size();
    Stretch stretch{std::move(w.key), w.number, 0, 0, {}, {}, {}, false, 0, 0};
    if (w.old == PlannedStretch::kNone) {
      stretch.open.emplace(whole, profile);
    } else {
      stretch = std::move(stretches_[w.old]);
      stretches_[w.old].open.reset();
      if (!stretch.open && grows) {
        stretch.open = Reopen(w.old, std::span(w.frames).first(w.kept), profile);
      }
      settled_numbers[w.old] = stretch.open ? SettledSegments::kGone : i;
    }
    stretch.session = 0;
    stretch.vehicle = 0;
    if (!next.empty()) {
      const Stretch& before = next.back();
      stretch.session = before.session + (before.key == stretch.key ? 0u : 1u);
      stretch.vehicle = before.vehicle + (before.key.vehicle == stretch.key.vehicle ? 0u : 1u);
    }
    stretch.frames = std::move(w.frames);
    stretch.times_ms.clear();
    for (const StretchMember& frame : stretch.frames) {
      stretch.times_ms.push_back(frame.time_ms);
    }
    stretch.grown_at = grows ? expected_count_ : stretch.grown_at;
    next.push_back(std::move(stretch));
  }
  for (const Stretch& dropped : stretches_) {
    if (dropped.open) {
      dropped.open->FindCells(touched_);
    }
  }
  settled_.Renumber(settled_numbers, touched_);
  stretches_ = std::move(next);
}

StretchSurvey TileSurveys::Reopen(std::uint32_t number,
                                  std::span<const StretchMember> frames,
                                  const MapProfile& profile) const {
  StretchSurvey survey({id_, 0, profile.tile_cells}, profile);
  for (const StretchMember& frame : frames) {
    survey.AddFrame({frame.sequence, frame.time_ms});
  }
  settled_.CopyTo(number, survey);
  return survey;
}

bool TileSurveys::IsToSettle(std::size_t i, std::int64_t latest_ms) const {
  const Stretch& stretch = stretches_[i];
  const std::uint32_t idle = expected_count_ - stretch.grown_at;
  if (!stretch.open || idle == 0) {
    return false;
  }
  const bool session_goes_on = i + 1 < stretches_.size() && stretches_[i + 1].key == stretch.key;
  const bool is_over = stretch.frames.back().time_ms < latest_ms - kVisitMs;
  return session_goes_on || idle > kOpenFusions || (is_over && idle > kVisitFusions);
}

void TileSurveys::Settle(const MapProfile& profile) {
  std::int64_t latest_ms = std::numeric_limits<std::int64_t>::min();
  for (const Stretch& stretch : stretches_) {
    latest_ms = std::max(latest_ms, stretch.frames.back().time_ms);
  }
  std::vector<std::uint32_t> settling;
  for (std::uint32_t i = 0; i < stretches_.size(); ++i) {
    if (IsToSettle(i, latest_ms)) {
      settling.push_back(i);
    }
  }
  if (settling.empty()) {
    return;
  }
  BoundedChoice choice(profile);
  SettledSegments merged;
  for (std::size_t cell = 0; cell + 1 < tile_.cell_begin.size(); ++cell) {
    segments_.clear();
    CollectSettled(cell);
    for (const std::uint32_t i : settling) {
      CollectOpen(cell, i);
    }
    SortByStretch(segments_);
    if (profile.preset == FusionPreset::kBounded) {
      Forget(choice);
    }
    for (const SegmentView& view : segments_) {
      merged.Append(*view.segment, view.stretch);
    }
    merged.EndCell();
  }
  settled_ = std::move(merged);
  for (const std::uint32_t i : settling) {
    stretches_[i].open.reset();
  }
}

// Leaves those of segments_ that count while they all are there.
void TileSurveys::Forget(BoundedChoice& choice) {
  const std::size_t kept = choice.MoveLatestToFront(segments_);
  for (const SegmentView& view : std::span(segments_).subspan(kept)) {
    SetUsed(view, false);
    stretches_[view.stretch].has_forgotten = true;
  }
  segments_.resize(kept);
}

const Tile& TileSurveys::Combine(const FusionContext& context) {
  assert(awaited_.empty());
  for (const std::uint32_t i : open_) {
    StretchSurvey& survey = *stretches_[i].open;
    touched_.InsertAll(survey.touched());
    survey.ClearTouched();
  }
  CellCombiner combiner(context.sigmas, context.profile);
  Tile tile = EmptyTile(id_, context.profile);
  tile.layers.reserve(tile_.layers.size());
  for (std::size_t cell = 0; cell + 1 < tile.cell_begin.size(); ++cell) {
    if (touched_.Contains(cell)) {
      CombineCell(cell, combiner, tile.layers);
    } else {
      const auto layers = tile_.Layers(cell);
      tile.layers.insert(tile.layers.end(), layers.begin(), layers.end());
    }
    tile.cell_begin[cell + 1] = static_cast<std::uint32_t>(tile.layers.size());
  }
  for (const Stretch& stretch : stretches_) {
    const bool is_new = tile.contributors.empty() || tile.contributors.back() != stretch.key;
    if (stretch.used > 0 && is_new) {
      tile.contributors.push_back(stretch.key);
    }
  }
  tile_ = std::move(tile);
  touched_.Clear();
  return tile_;
}

void TileSurveys::CombineCell(std::size_t cell,
                              CellCombiner& combiner,
                              std::vector<TileLayer>& out) {
  segments_.clear();
  CollectSettled(cell);
  for (const std::uint32_t i : open_) {
    CollectOpen(cell, i);
  }
  if (segments_.empty()) {
    return;
  }
  SortByStretch(segments_);
  combiner.Combine(segments_, out);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    SetUsed(segments_[i], combiner.IsUsed(i));
  }
}

// Most stay what they were: what is not written is not to be carried back to memory.
void TileSurveys::SetUsed(const SegmentView& view, bool is_used) {
  if (view.segment->is_used != is_used) {
    std::uint32_t& used = stretches_[view.stretch].used;
    used = is_used ? used + 1 : used - 1;
    view.segment->is_used = is_used;
  }
}

void TileSurveys::CollectSettled(std::size_t cell) {
  const std::span segments = settled_.Segments(cell);
  const std::span stretches = settled_.Stretches(cell);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    segments_.push_back(View(segments[i], stretches[i]));
  }
}

void TileSurveys::CollectOpen(std::size_t cell, std::uint32_t stretch) {
  StretchSurvey& open = *stretches_[stretch].open;
  for (std::uint32_t i = open.First(cell); i != Segment::kNone; i = open.At(i).next) {
    segments_.push_back(View(open.At(i), stretch));
  }
}

SegmentView TileSurveys::View(Segment& segment, std::uint32_t stretch) const {
  const Stretch& its = stretches_[stretch];
  return {
      .segment = &segment,
      .last_time_ms = its.times_ms[segment.last_frame],
      .driven_ms = segment.driven_frame == Segment::kNone ? 0 : its.times_ms[segment.driven_frame],
      .stretch = stretch,
      .session = its.session,
      .vehicle = its.vehicle};
}

std::size_t TileSurveys::bytes() const {
  std::size_t bytes = sizeof(*this) + settled_.bytes() +
                      tile_.layers.capacity() * sizeof(TileLayer) +
                      tile_.cell_begin.capacity() * sizeof(std::uint32_t);
  for (const Stretch& stretch : stretches_) {
    bytes += sizeof(Stretch) + stretch.frames.capacity() * sizeof(StretchMember) +
             stretch.times_ms.capacity() * sizeof(std::int64_t) +
             (stretch.open ? stretch.open->bytes() : 0);
  }
  return bytes;
}

std::size_t TileSurveys::ExpectedBytes(const MapProfile& profile) const {
  constexpr std::size_t kCellBytes = 128;  // a segment or two of each stretch
  std::size_t growing = 0;
  for (std::size_t i = 0; i < awaited_.size(); ++i) {
    growing += i == 0 || awaited_[i] != awaited_[i - 1] ? 1u : 0u;
  }
  return bytes() + growing * profile.tile_cells * profile.tile_cells * kCellBytes;
}

// Repeated calls of either do nothing.
void TileSurveys::Pack() {
  if (is_packed_) {
    return;
  }
  is_packed_ = true;
  settled_.Pack();
  for (Stretch& stretch : stretches_) {
    stretch.used = 0;
    if (stretch.open) {
      stretch.open->Pack();
    }
  }
  tile_ = Tile();
}

void TileSurveys::Unpack() {
  if (!is_packed_) {
    return;
  }
  is_packed_ = false;
  settled_.Unpack();
  for (Stretch& stretch : stretches_) {
    if (stretch.open) {
      stretch.open->Unpack();
    }
  }
}

}  // namespace atlas
