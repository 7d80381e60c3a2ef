#include "core/fusion/tile_surveys.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

#include "core/base/small_sort.h"
#include "core/fusion/combination/bounded_guards.h"

namespace atlas {
namespace {

// A stretch settles when its session went on with another one; when the tile was fused this often
// without it; or when it is this much older than the latest, a visit that is over, and the tile was
// fused a few times without it.
constexpr std::uint32_t kOpenFusions = 16;
constexpr std::int64_t kVisitMs = 60'000;
constexpr std::uint32_t kVisitFusions = 2;

// Preset bounded: what is set aside of each band and vehicle of a cell.
constexpr std::size_t kSpareSegments = 2;

void SortByStretch(std::vector<SegmentView>& segments) {
  const auto is_before = [](const SegmentView& a, const SegmentView& b) {
    return a.stretch < b.stretch;
  };
  SmallStableSort(segments.begin(), segments.end(), is_before);
}

// As a stretch's survey has them: those that it saw last first.
void SortAsSurveyed(std::vector<SegmentView>& segments) {
  const auto is_before = [](const SegmentView& a, const SegmentView& b) {
    return a.stretch != b.stretch ? a.stretch < b.stretch
                                  : a.segment->last_frame > b.segment->last_frame;
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
  Settle(profile);
  std::vector<PlannedStretch> wanted = Plan(change, profile);
  if (const std::vector<bool> leaving = FindLeaving(wanted);
      std::find(leaving.begin(), leaving.end(), true) != leaving.end()) {
    RestoreSpare();
    if (MayForgottenCount(leaving, profile)) {
      SurveyForgottenAgain(wanted);
    }
  }
  TakeStretches(wanted, profile);

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

// Which stretches leave the settled ones, by their places: those that go, change, or grow. One that
// grows and has forgotten some of its segments starts over.
std::vector<bool> TileSurveys::FindLeaving(std::span<PlannedStretch> wanted) const {
  std::vector<bool> is_leaving(stretches_.size());
  for (std::size_t i = 0; i < stretches_.size(); ++i) {
    is_leaving[i] = !stretches_[i].open;
  }
  for (PlannedStretch& w : wanted) {
    if (w.old == PlannedStretch::kNone) {
      continue;
    }
    if (w.kept == w.frames.size()) {
      is_leaving[w.old] = false;
    } else if (stretches_[w.old].has_forgotten) {
      w.StartOver();
    }
  }
  return is_leaving;
}

// What was set aside is settled again, as if it had never been: a change may let it count.
void TileSurveys::RestoreSpare() {
  if (spare_.bytes() == 0) {
    return;
  }
  spare_.Unpack();
  const std::vector<std::uint32_t> places = PlacesById();
  SettledSegments merged;
  for (std::size_t cell = 0; cell + 1 < tile_.cell_begin.size(); ++cell) {
    segments_.clear();
    rest_.clear();
    CollectSettled(cell);
    CollectSpare(cell, places);
    segments_.insert(segments_.end(), rest_.begin(), rest_.end());
    SortAsSurveyed(segments_);
    for (const SegmentView& view : segments_) {
      merged.Append(*view.segment, view.stretch);
    }
    merged.EndCell();
  }
  settled_ = std::move(merged);
  spare_ = SettledSegments();
}

// Of each id the stretch's place, kGone of those that are not there any more.
std::vector<std::uint32_t> TileSurveys::PlacesById() const {
  std::vector<std::uint32_t> places(next_id_, SettledSegments::kGone);
  for (std::uint32_t i = 0; i < stretches_.size(); ++i) {
    places[stretches_[i].id] = i;
  }
  return places;
}

// Appends a cell's spare segments to rest_.
void TileSurveys::CollectSpare(std::size_t cell, std::span<const std::uint32_t> places) {
  const std::span segments = spare_.Segments(cell);
  const std::span ids = spare_.Stretches(cell);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    if (places[ids[i]] != SettledSegments::kGone) {
      rest_.push_back(View(segments[i], places[ids[i]]));
    }
  }
}

bool TileSurveys::MayForgottenCount(const std::vector<bool>& is_leaving,
                                    const MapProfile& profile) {
  const bool any_forgotten = std::any_of(stretches_.begin(), stretches_.end(),
                                         [](const Stretch& s) { return s.has_forgotten; });
  if (!any_forgotten) {
    return false;
  }
  for (std::size_t cell = 0; cell + 1 < tile_.cell_begin.size(); ++cell) {
    segments_.clear();
    CollectSettled(cell);
    const auto left =
        std::stable_partition(segments_.begin(), segments_.end(),
                              [&](const SegmentView& view) { return is_leaving[view.stretch]; });
    if (MayCountAgain({segments_.begin(), left}, {left, segments_.end()}, profile)) {
      return true;
    }
  }
  return false;
}

// Then nothing is forgotten any more, and nothing guarded.
void TileSurveys::SurveyForgottenAgain(std::span<PlannedStretch> wanted) {
  for (PlannedStretch& w : wanted) {
    if (w.old != PlannedStretch::kNone && stretches_[w.old].has_forgotten) {
      w.StartOver();
    }
  }
  for (std::size_t cell = 0; cell + 1 < tile_.cell_begin.size(); ++cell) {
    for (Segment& segment : settled_.Segments(cell)) {
      segment.guards_vehicle = false;
      segment.guards_band = false;
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
    Stretch stretch{std::move(w.key), w.number, 0, 0, 0, {}, {}, {}, false, 0, 0};
    if (w.old == PlannedStretch::kNone) {
      stretch.id = next_id_++;
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
  if (spare_.bytes() != 0) {
    spare_.Unpack();
  }
  const std::vector<std::uint32_t> places = PlacesById();
  BoundedChoice choice(profile);
  SettledSegments merged;
  SettledSegments spare;
  for (std::size_t cell = 0; cell + 1 < tile_.cell_begin.size(); ++cell) {
    segments_.clear();
    CollectSettled(cell);
    for (const std::uint32_t i : settling) {
      CollectOpen(cell, i);
    }
    SortByStretch(segments_);
    if (profile.preset == FusionPreset::kBounded) {
      rest_.clear();
      CollectSpare(cell, places);
      SetAside(choice, profile, spare);
    }
    for (const SegmentView& view : segments_) {
      merged.Append(*view.segment, view.stretch);
    }
    merged.EndCell();
    spare.EndCell();
  }
  settled_ = std::move(merged);
  for (const std::uint32_t i : settling) {
    stretches_[i].open.reset();
  }
  spare_ = SettledSegments();
  if (!spare.is_empty()) {
    spare_ = std::move(spare);
    spare_.Pack();
  }
}

// Leaves those of segments_ that count while they all are there. Of the others and those of rest_
// some go to `spare`, and what is left is forgotten.
void TileSurveys::SetAside(BoundedChoice& choice,
                           const MapProfile& profile,
                           SettledSegments& spare) {
  const std::size_t kept = choice.MoveLatestToFront(segments_);
  for (const SegmentView& view : std::span(segments_).subspan(kept)) {
    SetUsed(view, false);
    rest_.push_back(view);
  }
  segments_.resize(kept);
  const std::size_t spared = MoveSpareToFront(rest_, kSpareSegments, profile);
  const std::span forgotten = std::span(rest_).subspan(spared);
  segments_.insert(segments_.end(), rest_.begin(), rest_.end() - std::ssize(forgotten));
  MarkGuards(segments_, forgotten, profile);
  segments_.resize(kept);
  for (const SegmentView& view : std::span(rest_).first(spared)) {
    spare.Append(*view.segment, stretches_[view.stretch].id);
  }
  for (const SegmentView& view : forgotten) {
    stretches_[view.stretch].has_forgotten = true;
  }
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
  std::size_t bytes = sizeof(*this) + settled_.bytes() + spare_.bytes() +
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
