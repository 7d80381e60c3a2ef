#include "core/fusion/settled_stretches.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/base/small_sort.h"

namespace atlas {
namespace {

std::size_t CellsOfTile(const MapProfile& profile) {
  return static_cast<std::size_t>(profile.tile_cells) * profile.tile_cells;
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

void SettledStretches::Collect(std::size_t cell,
                               std::span<const TileStretch> stretches,
                               std::vector<SegmentView>& segments) {
  const std::span its = settled_.Segments(cell);
  const std::span places = settled_.Stretches(cell);
  for (std::size_t i = 0; i < its.size(); ++i) {
    segments.push_back(ViewOf(its[i], places[i], stretches));
  }
}

void SettledStretches::Settle(std::span<const std::uint32_t> settling,
                              std::span<TileStretch> stretches,
                              const MapProfile& profile) {
  if (!spare_places_.empty()) {
    spare_.Unpack();
  }
  marks_.Unpack();
  BoundedChoice choice(profile);
  Forgetting forgetting(profile);
  std::size_t segments = settled_.size();
  for (const std::uint32_t place : settling) {
    segments += stretches[place].open->size();
  }
  SettledSegments merged;
  merged.Reserve(CellsOfTile(profile), segments);
  SettledSegments spare;
  CellMarks marks;
  for (std::size_t cell = 0; cell < CellsOfTile(profile); ++cell) {
    segments_.clear();
    rest_.clear();
    Collect(cell, stretches, segments_);
    for (const std::uint32_t place : settling) {
      CollectOpen(cell, place, stretches, segments_);
    }
    SortByStretch(segments_);
    if (profile.preset == FusionPreset::kBounded) {
      CollectSpare(cell, stretches);
      const std::span known = marks_.Marks(cell);
      cell_marks_.assign(known.begin(), known.end());
      SetAside(choice, forgetting, stretches);
      marks.AppendCell(cell_marks_);
    }
    for (const SegmentView& view : segments_) {
      merged.Append(*view.segment, view.stretch);
    }
    merged.EndCell();
    for (const SegmentView& view : rest_) {
      spare.Append(*view.segment, view.stretch);
    }
    spare.EndCell();
  }
  settled_ = std::move(merged);
  for (const std::uint32_t place : settling) {
    stretches[place].open.reset();
  }
  marks_ = std::move(marks);
  marks_.Pack();
  spare_ = SettledSegments();
  spare_places_.clear();
  if (!spare.is_empty()) {
    spare_ = std::move(spare);
    spare_.Pack();
    spare_places_.resize(stretches.size());
    std::iota(spare_places_.begin(), spare_places_.end(), 0u);
  }
}

// Leaves those of segments_ that count while they all are there, and of the others and those of
// rest_ in rest_ what must not be forgotten; of what is forgotten, cell_marks_ knows.
void SettledStretches::SetAside(BoundedChoice& choice,
                                Forgetting& forgetting,
                                std::span<TileStretch> stretches) {
  const std::size_t kept = choice.MoveLatestToFront(segments_);
  for (const SegmentView& view : std::span(segments_).subspan(kept)) {
    SetUsed(view, false, stretches);
    rest_.push_back(view);
  }
  segments_.resize(kept);
  const std::size_t spared = forgetting.MoveSpareToFront(segments_, rest_, cell_marks_);
  for (const SegmentView& view : std::span(rest_).subspan(spared)) {
    stretches[view.stretch].has_forgotten = true;
  }
  rest_.resize(spared);
}

// Appends a cell's spare segments to rest_.
void SettledStretches::CollectSpare(std::size_t cell, std::span<const TileStretch> stretches) {
  const std::span segments = spare_.Segments(cell);
  const std::span places = spare_.Stretches(cell);
  for (std::size_t i = 0; i < segments.size(); ++i) {
    rest_.push_back(ViewOf(segments[i], spare_places_[places[i]], stretches));
  }
}

bool SettledStretches::PrepareToLose(const std::vector<bool>& is_staying,
                                     std::span<const TileStretch> stretches,
                                     const MapProfile& profile) {
  Restore(stretches, CellsOfTile(profile));
  if (marks_.is_empty()) {
    return false;
  }
  CellMarks marks = marks_;
  marks.Unpack();
  Forgetting forgetting(profile);
  for (std::size_t cell = 0; cell < CellsOfTile(profile); ++cell) {
    if (marks.Marks(cell).empty()) {
      continue;
    }
    segments_.clear();
    Collect(cell, stretches, segments_);
    std::erase_if(segments_, [&](const SegmentView& view) { return !is_staying[view.stretch]; });
    if (forgetting.MayCount(marks.Marks(cell), segments_)) {
      marks_ = CellMarks();
      return true;
    }
  }
  return false;
}

// As if nothing had ever been set aside.
void SettledStretches::Restore(std::span<const TileStretch> stretches, std::size_t cells) {
  if (spare_places_.empty()) {
    return;
  }
  spare_.Unpack();
  SettledSegments merged;
  for (std::size_t cell = 0; cell < cells; ++cell) {
    segments_.clear();
    rest_.clear();
    Collect(cell, stretches, segments_);
    CollectSpare(cell, stretches);
    segments_.insert(segments_.end(), rest_.begin(), rest_.end());
    SortAsSurveyed(segments_);
    for (const SegmentView& view : segments_) {
      merged.Append(*view.segment, view.stretch);
    }
    merged.EndCell();
  }
  settled_ = std::move(merged);
  spare_ = SettledSegments();
  spare_places_.clear();
}

// Nothing is set aside of a stretch that leaves.
void SettledStretches::Renumber(std::span<const std::uint32_t> places, CellSet& touched) {
  settled_.Renumber(places, touched);
  for (std::uint32_t& place : spare_places_) {
    place = place == kGone ? kGone : places[place];
  }
}

void SettledStretches::Save(ByteWriter& out) const {
  for (const SettledSegments* segments : {&settled_, &spare_}) {
    const Bytes packed = segments->PackedCopy();
    out.Varint(packed.size());
    out.Raw(packed);
  }
  out.Varint(marks_.packed().size());
  out.Raw(marks_.packed());
  out.Varint(spare_places_.size());
  for (const std::uint32_t place : spare_places_) {
    out.U32(place);
  }
}

SettledStretches SettledStretches::Load(ByteReader& in) {
  SettledStretches loaded;
  for (SettledSegments* segments : {&loaded.settled_, &loaded.spare_}) {
    const ByteSpan packed = in.Raw(in.Varint());
    *segments = SettledSegments(Bytes(packed.begin(), packed.end()));
  }
  const ByteSpan marks = in.Raw(in.Varint());
  loaded.marks_ = CellMarks(Bytes(marks.begin(), marks.end()));
  const std::uint64_t places = in.Varint();
  for (std::uint64_t i = 0; i < places && in.ok(); ++i) {
    loaded.spare_places_.push_back(in.U32());
  }
  return loaded;
}

}  // namespace atlas
