#include "core/fusion/combined_tile.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace atlas {

std::size_t CombinedTile::bytes() const {
  return tile_.layers.capacity() * sizeof(TileLayer) +
         tile_.cell_begin.capacity() * sizeof(std::uint32_t) +
         references_mm_.capacity() * sizeof(std::int32_t);
}

void CombinedTile::Begin(const TileId& id, const MapProfile& profile) {
  tile_ = EmptyTile(id, profile);
  references_mm_.clear();
}

void CombinedTile::Update(const CellSet& touched,
                          const TileSegments& from,
                          const FusionContext& context) {
  CellSet revised(tile_.cell_begin.size() - 1);  // cells of which segments were
  for (const std::uint32_t place : from.open) {
    StretchSurvey& survey = *from.stretches[place].open;
    revised.InsertAll(survey.touched());
    survey.ClearTouched();
  }
  CellCombiner combiner(context.sigmas, context.profile);
  CombinedTile out;
  out.Begin(tile_.id, context.profile);
  out.tile_.layers.reserve(tile_.layers.size());
  out.references_mm_.reserve(references_mm_.size());
  for (std::size_t cell = 0; cell + 1 < tile_.cell_begin.size(); ++cell) {
    const bool is_touched = touched.Contains(cell);
    if (!is_touched && !revised.Contains(cell)) {
      Copy(cell, out);
    } else if (is_touched || !CombinePart(cell, from, combiner, out)) {
      CombineWhole(cell, from, combiner, out);
    }
    out.tile_.cell_begin[cell + 1] = static_cast<std::uint32_t>(out.tile_.layers.size());
  }
  for (const TileStretch& stretch : from.stretches) {
    auto& contributors = out.tile_.contributors;
    const bool is_new = contributors.empty() || contributors.back() != stretch.key;
    if (stretch.used > 0 && is_new) {
      contributors.push_back(stretch.key);
    }
  }
  tile_ = std::move(out.tile_);
  references_mm_ = std::move(out.references_mm_);
}

std::span<const std::int32_t> CombinedTile::References(std::size_t cell) const {
  return std::span(references_mm_).subspan(tile_.cell_begin[cell], tile_.Layers(cell).size());
}

void CombinedTile::Copy(std::size_t cell, CombinedTile& out) const {
  const auto layers = tile_.Layers(cell);
  const auto references_mm = References(cell);
  out.tile_.layers.insert(out.tile_.layers.end(), layers.begin(), layers.end());
  out.references_mm_.insert(out.references_mm_.end(), references_mm.begin(), references_mm.end());
}

void CombinedTile::CombineWhole(std::size_t cell,
                                const TileSegments& from,
                                CellCombiner& combiner,
                                CombinedTile& out) {
  segments_.clear();
  from.settled.Collect(cell, from.stretches, segments_);
  for (const std::uint32_t place : from.open) {
    CollectOpen(cell, place, from.stretches, segments_);
  }
  if (segments_.empty()) {
    return;
  }
  SortByStretch(segments_);
  combiner.Combine(segments_, nullptr, out.tile_.layers);
  for (const CellLayer& layer : combiner.layers()) {
    out.references_mm_.push_back(layer.reference_mm);
  }
  SetCombined(from, combiner);
}

// Combines only the part of the cell that the revised segments are in, and copies the others'
// layers. False, and nothing is done, where it is all of it, or can reach further: a layer's
// altitude, the mean of what was seen, is far from its segments; there are as many layers as a cell
// may have; or the column below ends elsewhere.
bool CombinedTile::CombinePart(std::size_t cell,
                               const TileSegments& from,
                               CellCombiner& combiner,
                               CombinedTile& out) {
  const std::optional<Part> part = FindPart(cell, from, combiner.profile());
  if (!part) {
    return false;
  }
  CollectPart(*part, from);
  const auto layers = tile_.Layers(cell);
  layers_.clear();
  combiner.Combine(segments_, part->end < layers.size() ? &layers[part->end].altitude_mm : nullptr,
                   layers_);
  if (!IsCopyable(cell, *part, combiner.profile())) {
    return false;
  }
  const auto references_mm = References(cell);
  const auto copy = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      out.tile_.layers.push_back(layers[i]);
      out.references_mm_.push_back(references_mm[i]);
    }
  };
  copy(0, part->begin);
  out.tile_.layers.insert(out.tile_.layers.end(), layers_.begin(), layers_.end());
  for (const CellLayer& layer : combiner.layers()) {
    out.references_mm_.push_back(layer.reference_mm);
  }
  copy(part->end, layers.size());
  SetCombined(from, combiner);
  return true;
}

// Collects the cell's segments, too.
std::optional<CombinedTile::Part> CombinedTile::FindPart(std::size_t cell,
                                                         const TileSegments& from,
                                                         const MapProfile& profile) {
  const auto references_mm = References(cell);
  if (references_mm.size() < 2 || references_mm.size() >= kMaxCellLayers) {
    return std::nullopt;
  }
  const CellPart revised = CollectPlainly(cell, from);
  if (revised.is_empty()) {
    return std::nullopt;
  }
  Part part{Grow(revised, plain_, PartReach(profile)), 0, 0};
  while (part.begin < references_mm.size() &&
         references_mm[part.begin] < part.altitudes.lowest_mm) {
    ++part.begin;
  }
  part.end = part.begin;
  while (part.end < references_mm.size() && part.altitudes.Contains(references_mm[part.end])) {
    ++part.end;
  }
  return IsAtHome(cell, part, profile) ? std::optional(part) : std::nullopt;
}

// Whether each layer of the cell is where its segments are: the part's near it, the others away.
bool CombinedTile::IsAtHome(std::size_t cell, const Part& part, const MapProfile& profile) const {
  const auto layers = tile_.Layers(cell);
  const auto references_mm = References(cell);
  const std::int64_t below_mm = part.altitudes.lowest_mm - profile.other_layer_mm;
  const std::int64_t above_mm = part.altitudes.highest_mm + profile.other_layer_mm;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const std::int64_t altitude_mm = layers[i].altitude_mm;
    const bool is_at_home =
        i < part.begin ? altitude_mm <= below_mm
        : i < part.end ? part.altitudes.IsNear(altitude_mm)
                       : altitude_mm >= above_mm && references_mm[i] > part.altitudes.highest_mm;
    if (!is_at_home) {
      return false;
    }
  }
  return true;
}

// The part's segments into segments_.
void CombinedTile::CollectPart(const Part& part, const TileSegments& from) {
  segments_.clear();
  for (const CellSegment& s : plain_) {
    if (part.altitudes.Contains(s.altitude_mm)) {
      segments_.push_back(ViewOf(*s.segment, s.stretch, from.stretches));
    }
  }
  SortByStretch(segments_);
}

// Whether the other layers stay as they are beside the part's new ones.
bool CombinedTile::IsCopyable(std::size_t cell, const Part& part, const MapProfile& profile) const {
  const auto layers = tile_.Layers(cell);
  const std::size_t count = part.begin + layers_.size() + layers.size() - part.end;
  if (count >= kMaxCellLayers ||
      !std::all_of(layers_.begin(), layers_.end(), [&](const TileLayer& layer) {
        return part.altitudes.IsNear(layer.altitude_mm);
      })) {
    return false;
  }
  if (part.begin == 0) {
    return true;
  }
  const auto altitude_at = [&](std::size_t i) {
    return i < layers.size() ? &layers[i].altitude_mm : nullptr;
  };
  const std::int32_t below_mm = layers[part.begin - 1].altitude_mm;
  const std::int32_t* was_mm = altitude_at(part.begin);
  const std::int32_t* is_mm = layers_.empty() ? altitude_at(part.end) : &layers_[0].altitude_mm;
  return ColumnSpanOf(below_mm, was_mm, profile).mask ==
         ColumnSpanOf(below_mm, is_mm, profile).mask;
}

// All segments of a cell into plain_. Returns where those that are revised are and were.
CellPart CombinedTile::CollectPlainly(std::size_t cell, const TileSegments& from) {
  plain_.clear();
  const std::span settled = from.settled.Segments(cell);
  const std::span places = from.settled.Places(cell);
  for (std::size_t i = 0; i < settled.size(); ++i) {
    plain_.push_back({&settled[i], settled[i].altitude_mm, places[i]});
  }
  CellPart revised;
  for (const std::uint32_t place : from.open) {
    StretchSurvey& open = *from.stretches[place].open;
    for (std::uint32_t i = open.First(cell); i != Segment::kNone; i = open.At(i).next) {
      Segment& segment = open.At(i);
      plain_.push_back({&segment, segment.altitude_mm, place});
      if (segment.is_revised) {
        revised.Add(segment.altitude_mm);
        revised.Add(open.CombinedAltitude(i));
      }
    }
  }
  return revised;
}

// Notes of segments_ that they were.
void CombinedTile::SetCombined(const TileSegments& from, const CellCombiner& combiner) {
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    SetUsed(segments_[i], combiner.IsUsed(i), from.stretches);
    if (segments_[i].segment->is_revised) {
      from.stretches[segments_[i].stretch].open->SetCombined(*segments_[i].segment);
    }
  }
}

}  // namespace atlas
