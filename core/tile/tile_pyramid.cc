#include "core/tile/tile_pyramid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <span>

#include "core/base/integer_math.h"
#include "core/base/small_sort.h"
#include "core/tile/column_lattice.h"
#include "core/tile/layer_association.h"
#include "core/tile/sigma_code.h"

namespace atlas {
namespace {

constexpr std::int64_t kInformationScale = std::int64_t{1} << 40;  // information = scale / sigma^2

struct ChildLayer {
  const TileLayer* layer = nullptr;
  std::uint8_t cell = 0;  // 0..3: which of the four child cells
};

std::int64_t SigmaOf(const TileLayer& layer) {
  return std::max<std::int64_t>(layer.sigma_100um, 1);
}

std::int64_t Information(const TileLayer& layer) {
  return std::max<std::int64_t>(RoundDiv(kInformationScale, SigmaOf(layer) * SigmaOf(layer)), 1);
}

// Of each nibble the larger.
std::uint64_t MaxNibbles(std::uint64_t a, std::uint64_t b) {
  using Lanes = std::uint8_t __attribute__((vector_size(16)));
  using Halves = std::array<std::uint64_t, 2>;  // the nibbles at even and at odd places
  constexpr std::uint64_t kEven = 0x0F0F'0F0F'0F0F'0F0F;
  const auto lanes_a = std::bit_cast<Lanes>(Halves{a & kEven, (a >> 4) & kEven});
  const auto lanes_b = std::bit_cast<Lanes>(Halves{b & kEven, (b >> 4) & kEven});
  const Lanes larger = lanes_a > lanes_b ? lanes_a : lanes_b;
  const auto [even, odd] = std::bit_cast<Halves>(larger);
  return even | (odd << 4);
}

void CombineAltitudes(std::span<const ChildLayer> group, TileLayer& parent) {
  const std::int64_t reference_mm = group.front().layer->altitude_mm;
  std::int64_t information = 0;
  Int128 moment = 0;
  for (const ChildLayer& child : group) {
    const std::int64_t weight = Information(*child.layer);
    information += weight;
    moment += Int128{weight} * (child.layer->altitude_mm - reference_mm);
  }
  parent.altitude_mm = static_cast<std::int32_t>(reference_mm + RoundDiv128(moment, information));
  const std::uint64_t half_units =
      Isqrt(static_cast<std::uint64_t>(RoundDiv(4 * kInformationScale, information)));
  parent.sigma_100um = RoundSigma100um((half_units + 1) / 2);
}

// Occupancy, flags, observations and the time.
void CombineEvidence(std::span<const ChildLayer> group, TileLayer& parent) {
  unsigned cells = 0;
  unsigned all_flags = ~0u;
  unsigned any_flags = 0;
  parent.occupancy = group.front().layer->occupancy;
  parent.observations = group.front().layer->observations;
  for (const auto& [layer, cell] : group) {
    cells |= 1u << cell;
    all_flags &= layer->flags;
    any_flags |= layer->flags;
    parent.occupancy = std::max(parent.occupancy, layer->occupancy);
    parent.observations = std::min(parent.observations, layer->observations);
    parent.confirmed_s = std::max(parent.confirmed_s, layer->confirmed_s);
  }
  constexpr unsigned kAllCells = 15;
  const unsigned traversable = cells == kAllCells ? all_flags & TileLayer::kTraversable : 0;
  parent.flags = static_cast<std::uint8_t>(
      traversable | (any_flags & (TileLayer::kTraversableAny | TileLayer::kMeasured)));
}

std::uint64_t CombineColumns(std::span<const ChildLayer> group,
                             const ColumnSpan& span,
                             const MapProfile& profile) {
  std::uint64_t column = 0;
  for (const ChildLayer& child : group) {
    if (child.layer->column != 0) {
      const std::int32_t base = ColumnBaseIndex(child.layer->altitude_mm, profile);
      column = MaxNibbles(column, FitColumn(child.layer->column, base, span));
    }
  }
  return column;
}

// One parent cell at a time; holds scratch memory.
class ParentCellBuilder {
 public:
  explicit ParentCellBuilder(const MapProfile& profile) : profile_(profile) {}

  void Clear() { children_.clear(); }
  void Add(std::span<const TileLayer> layers, std::uint8_t cell) {
    for (const TileLayer& layer : layers) {
      children_.push_back({&layer, cell});
    }
  }

  // Appends the cell's layers, lowest first.
  void Build(std::vector<TileLayer>& out) {
    if (children_.empty()) {
      return;
    }
    SmallStableSort(children_.begin(), children_.end(), [](const auto& a, const auto& b) {
      return a.layer->altitude_mm < b.layer->altitude_mm;
    });
    FindGroups();
    CombineSurfaces();
    KeepBestSupported();
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      TileLayer& layer = groups_[i].layer;
      const std::int32_t* above =
          i + 1 < groups_.size() ? &groups_[i + 1].layer.altitude_mm : nullptr;
      layer.column = CombineColumns(groups_[i].children,
                                    ColumnSpanOf(layer.altitude_mm, above, profile_), profile_);
      out.push_back(layer);
    }
  }

 private:
  struct Group {
    std::span<const ChildLayer> children;
    TileLayer layer;
  };

  void FindGroups() {
    estimates_.clear();
    for (const ChildLayer& child : children_) {
      estimates_.push_back(
          {child.layer->altitude_mm, static_cast<std::uint32_t>(SigmaOf(*child.layer))});
    }
    labels_.resize(children_.size());
    groups_.assign(ChainLayers(estimates_, profile_, labels_), {});
    std::size_t begin = 0;
    for (std::size_t i = 1; i <= labels_.size(); ++i) {
      if (i == labels_.size() || labels_[i] != labels_[begin]) {
        groups_[labels_[begin]].children = std::span(children_).subspan(begin, i - begin);
        begin = i;
      }
    }
  }

  void CombineSurfaces() {
    for (Group& group : groups_) {
      CombineAltitudes(group.children, group.layer);
      CombineEvidence(group.children, group.layer);
    }
  }

  void KeepBestSupported() {
    if (groups_.size() <= kMaxCellLayers) {
      return;
    }
    std::stable_sort(groups_.begin(), groups_.end(), [](const Group& a, const Group& b) {
      return a.layer.observations > b.layer.observations;
    });
    groups_.resize(kMaxCellLayers);
    std::stable_sort(groups_.begin(), groups_.end(), [](const Group& a, const Group& b) {
      return a.layer.altitude_mm < b.layer.altitude_mm;
    });
  }

  const MapProfile& profile_;
  std::vector<ChildLayer> children_;
  std::vector<AltitudeEstimate> estimates_;
  std::vector<std::uint32_t> labels_;
  std::vector<Group> groups_;
};

// The four child cells under parent cell (x, y) lie in one child tile.
void AddChildCells(const std::array<const Tile*, 4>& children,
                   std::size_t x,
                   std::size_t y,
                   std::size_t side,
                   ParentCellBuilder& builder) {
  const std::size_t half = side / 2;
  const Tile* child = children[(y / half) * 2 + x / half];
  if (child == nullptr || child->is_empty()) {
    return;
  }
  for (std::uint8_t cell = 0; cell < 4; ++cell) {
    const std::size_t child_x = 2 * (x % half) + cell % 2u;
    const std::size_t child_y = 2 * (y % half) + cell / 2u;
    builder.Add(child->Layers(child_y * side + child_x), cell);
  }
}

std::vector<SessionKey> UnionOfContributors(const std::array<const Tile*, 4>& children) {
  std::vector<SessionKey> all;
  for (const Tile* child : children) {
    if (child != nullptr) {
      all.insert(all.end(), child->contributors.begin(), child->contributors.end());
    }
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace

Tile BuildParentTile(const TileId& id,
                     const std::array<const Tile*, 4>& children,
                     const MapProfile& profile) {
  const std::size_t side = profile.tile_cells;
  Tile parent = EmptyTile(id, profile);
  parent.contributors = UnionOfContributors(children);
  ParentCellBuilder builder(profile);
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) {
      builder.Clear();
      AddChildCells(children, x, y, side, builder);
      builder.Build(parent.layers);
      parent.cell_begin[y * side + x + 1] = static_cast<std::uint32_t>(parent.layers.size());
    }
  }
  return parent;
}

}  // namespace atlas
