#include "core/fusion/combined_tile.h"

#include <algorithm>
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
    if (touched.Contains(cell)) {
      CombineWhole(cell, from, combiner, out);
    } else if (!revised.Contains(cell)) {
      Copy(cell, out);
    } else if (!CombinePart(cell, from, combiner, out)) {
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
  combiner.Combine(segments_, {}, out.tile_.layers);
  for (const CellLayer& layer : combiner.layers()) {
    out.references_mm_.push_back(layer.reference_mm);
  }
  SetCombined(from, combiner);
}

// Combines only the part of the cell that the revised segments are in, and copies the others'
// layers. False, and nothing is done, where it is all of it, or can reach further: a layer's
// altitude, the mean of what was seen, is far from its segments; there are as many layers as a cell
// may have; the column below ends elsewhere; or nothing was measured elsewhere in the cell, so that
// guesses may or may not count there.
bool CombinedTile::CombinePart(std::size_t cell,
                               const TileSegments& from,
                               CellCombiner& combiner,
                               CombinedTile& out) {
  const MapProfile& profile = combiner.profile();
  const auto layers = tile_.Layers(cell);
  if (layers.size() < 2) {
    return false;
  }
  const CellPart revised = CollectPlainly(cell, from);
  if (revised.is_empty()) {
    return false;
  }
  const CellPart part = Grow(revised, plain_, PartReach(profile));
  const auto references_mm = References(cell);
  std::size_t begin = 0;
  while (begin < layers.size() && references_mm[begin] < part.lowest_mm) {
    ++begin;
  }
  std::size_t end = begin;
  while (end < layers.size() && part.Contains(references_mm[end])) {
    ++end;
  }
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const std::int64_t altitude_mm = layers[i].altitude_mm;
    const bool is_at_home = i < begin ? altitude_mm <= part.lowest_mm - profile.other_layer_mm
                            : i < end ? part.IsNear(altitude_mm)
                                      : altitude_mm >= part.highest_mm + profile.other_layer_mm &&
                                            references_mm[i] > part.highest_mm;
    if (!is_at_home) {
      return false;
    }
  }
  CellCombiner::Others others;
  segments_.clear();
  for (const CellSegment& s : plain_) {
    if (part.Contains(s.altitude_mm)) {
      segments_.push_back(ViewOf(*s.segment, s.stretch, from.stretches));
    } else {
      others.has_strong |= s.segment->is_strong;
    }
  }
  if (!others.has_strong) {
    return false;
  }
  SortByStretch(segments_);
  others.above_mm = end < layers.size() ? &layers[end].altitude_mm : nullptr;
  layers_.clear();
  combiner.Combine(segments_, others, layers_);
  const std::size_t count = begin + layers_.size() + layers.size() - end;
  if (count >= kMaxCellLayers || layers.size() >= kMaxCellLayers ||
      !std::all_of(layers_.begin(), layers_.end(),
                   [&](const TileLayer& layer) { return part.IsNear(layer.altitude_mm); })) {
    return false;
  }
  if (begin > 0) {
    const std::int32_t below_mm = layers[begin - 1].altitude_mm;
    const std::int32_t* was_mm = begin < layers.size() ? &layers[begin].altitude_mm : nullptr;
    const std::int32_t* is_mm = layers_.empty() ? others.above_mm : &layers_[0].altitude_mm;
    if (ColumnSpanOf(below_mm, was_mm, profile).mask !=
        ColumnSpanOf(below_mm, is_mm, profile).mask) {
      return false;
    }
  }
  const auto copy = [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      out.tile_.layers.push_back(layers[i]);
      out.references_mm_.push_back(references_mm[i]);
    }
  };
  copy(0, begin);
  out.tile_.layers.insert(out.tile_.layers.end(), layers_.begin(), layers_.end());
  for (const CellLayer& layer : combiner.layers()) {
    out.references_mm_.push_back(layer.reference_mm);
  }
  copy(end, layers.size());
  SetCombined(from, combiner);
  return true;
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
