#include "server/service/sync/local_area.h"

#include <algorithm>
#include <limits>

namespace atlas {
namespace {

// Bounds leave room for what was rounded: positions are within 1e8 m, where a double holds
// 1.5e-8 m, and a way of 255 legs adds up as many.
constexpr double kMargin_m = 1e-4;

double DiagonalOf(const MapSquare& square) {
  return (square.max_m - square.min_m).norm();
}

}  // namespace

LocalArea::LocalArea(const SyncArea& area, const TileId& corner, int bits) : area_(area) {
  const MapSquare square = area.SquareOf(corner, bits);
  if (area.shaping_legs() != nullptr) {
    ChooseTouching(square);
  }
  ChooseNearest(square);
}

void LocalArea::ChooseTouching(const MapSquare& square) {
  const double inside_m = area_.reach_m() - DiagonalOf(square) - kMargin_m;
  for (const SyncArea::Leg& leg : *area_.shaping_legs()) {
    if (GapOfBoxes(leg.from_m, leg.to_m, square).maxCoeff() > area_.reach_m() + kMargin_m) {
      continue;
    }
    if (GapOfBoxes(leg.from_m, leg.from_m, square).norm() <= inside_m) {
      is_all_inside_ = true;
      return;
    }
    touching_.push_back(&leg);
  }
}

// A leg is no farther off than where it begins, from no place in the square by more than its
// diagonal; and whatever of it is nearest counts its length along the way at most.
void LocalArea::ChooseNearest(const MapSquare& square) {
  const std::vector<SyncArea::Leg>& legs = area_.legs();
  if (legs.empty()) {
    return;
  }
  const double slack_m = DiagonalOf(square) + kMargin_m;
  most_m_ = std::numeric_limits<double>::infinity();
  for (const SyncArea::Leg& leg : legs) {
    const double start_m = SyncArea::kAlongWeight * leg.along_m;
    if (start_m >= most_m_) {
      break;
    }
    const double length_m = SyncArea::kAlongWeight * (leg.to_m - leg.from_m).norm();
    const double gap_m = GapOfBoxes(leg.from_m, leg.from_m, square).norm();
    most_m_ = std::min(most_m_, start_m + length_m + gap_m + slack_m);
  }
  for (const SyncArea::Leg& leg : legs) {
    const double start_m = SyncArea::kAlongWeight * leg.along_m;
    if (start_m > most_m_) {
      break;
    }
    const double least_m = start_m + GapOfBoxes(leg.from_m, leg.to_m, square).norm() - kMargin_m;
    if (least_m <= most_m_) {
      nearest_.push_back({std::max(least_m, 0.0), &leg});
    }
  }
  std::sort(nearest_.begin(), nearest_.end(),
            [](const NearLeg& a, const NearLeg& b) { return a.least_m < b.least_m; });
}

bool LocalArea::Touches(const TileId& id) const {
  if (area_.shaping_legs() == nullptr) {
    return area_.Touches(id);
  }
  return is_all_inside_ ||
         std::any_of(touching_.begin(), touching_.end(),
                     [&](const SyncArea::Leg* leg) { return area_.IsWithinReach(*leg, id, 0); });
}

double LocalArea::Distance(const TileId& id) const {
  if (nearest_.empty()) {
    return 0.0;
  }
  const MapSquare square = area_.SquareOf(id, 0);
  double best_m = std::numeric_limits<double>::infinity();
  for (const NearLeg& near : nearest_) {
    if (near.least_m >= best_m) {
      break;
    }
    best_m = SyncArea::Nearer(best_m, *near.leg, square);
  }
  return best_m;
}

}  // namespace atlas
