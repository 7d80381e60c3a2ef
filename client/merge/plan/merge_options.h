// All numbers of a merge.
#pragma once

#include <cstddef>
#include <numbers>

#include "client/merge/graph/pose_graph.h"
#include "client/merge/memory/merge_work.h"
#include "core/alignment/closure_sets.h"
#include "core/alignment/place_search.h"
#include "core/alignment/session_cut.h"
#include "core/alignment/submap.h"
#include "core/alignment/submap_match.h"
#include "core/base/status.h"

namespace atlas {

// Of positions that are known of keyframes.
struct PriorOptions {
  // What is wrong with a receiver's positions stays for a while: those of a session within so long
  // of each other know as much as one of them.
  double together_s = 30.0;
  // A position agrees within 3 of its radii, and by what poses may be off: before they are solved
  // for ...
  double slack_m = 2.0;
  // ... and where they hang on a map that stays.
  double held_slack_m = 0.5;
  // Which share of them has to agree, how many, and how far apart, root mean square and in radii.
  double min_share = 0.5;
  std::size_t min_priors = 10;
  double min_spread = 10.0;
  // Farther than odometry drifts: the map has another frame than the positions.
  double max_frame_shift_m = 10.0;
};

struct MergeOptions {
  CutOptions cut;
  SubmapOptions submaps;
  MatchOptions match;
  PlaceSearchOptions places;
  ConsistencyOptions consistency;
  PoseGraphOptions graph;
  PriorOptions priors;

  // Odometry, as the stored poses have it from one keyframe to the next.
  double odometry_drift = 0.01;  // of the way, one standard deviation as all of these
  double odometry_yaw_rad_a_m = 0.5 * std::numbers::pi / 180.0 / 100.0;
  double odometry_sigma_m = 0.01;  // of each step between submaps, besides
  double odometry_sigma_rad = 0.05 * std::numbers::pi / 180.0;
  // So much of that beside a match that is believed: what drifts to one side does so at each step,
  // and a hundred steps together bend a street that matches have straight.
  double odometry_share = 0.1;

  // A match informs as this share of its features would, were they independent, and is no better
  // than these.
  double information_share = 0.05;
  double match_sigma_m = 0.01;
  double match_sigma_rad = 0.03 * std::numbers::pi / 180.0;

  // Submaps of one session with less way between them do not meet: they are neighbours.
  double min_loop_m = 50.0;
  // Without an idea: every so many submaps of a session one is looked for in all others ...
  std::size_t probe_stride = 2;  // at least 1
  // ... and where the stored poses have it near others, around there.
  double near_m = 8.0;
  double near_height_m = 2.0;
  SearchReach reach{4.0, 4.0, 6.0 * std::numbers::pi / 180.0};

  // Two sessions meet where so many submaps agree that they do, and so many times as much speaks
  // for it as for any other way in which they might.
  std::size_t min_closures = 3;
  double min_margin = 1.3;

  // A closure that is off by more when everything has its place is wrong.
  double contradicted_m = 1.0;
  double contradicted_rad = 3.0 * std::numbers::pi / 180.0;

  // From the poses that were found all pairs are looked at that lie this near by them.
  // Further than a street is wide: also those that cross each other with a junction between them.
  double guided_m = 12.0;
  double guided_height_m = 1.0;
  std::size_t guided_neighbours = 2;  // in each session,
  std::size_t guided_most = 12;       // and of all earlier ones together, one of each first
  // Of a match from where it was expected: where a loop is not closed yet, a metre and more.
  double max_surprise_m = 2.0;
  double max_surprise_rad = 3.0 * std::numbers::pi / 180.0;
  // Where two are enough, for they are where they were expected: less than from deck to deck.
  double max_height_surprise_m = 1.0;
  int guided_rounds = 3;

  // Submaps that were fused before by poses this near are taken as they are, at the beginning, and
  // when all are fused again.
  ShapeTolerance known_shape{0.01, 0.15 * std::numbers::pi / 180.0};
  ShapeTolerance refined_shape{0.005, 0.06 * std::numbers::pi / 180.0};

  int refinements = 2;  // times that submaps are fused again by the poses found

  // Sessions in the map whose matches are this near their poses already, root mean square, stay.
  double held_m = 0.04;
  double held_rad = 0.15 * std::numbers::pi / 180.0;
  // A keyframe that would move by less stays.
  double min_move_m = 0.002;
  double min_move_rad = 0.02 * std::numbers::pi / 180.0;

  std::size_t workers = 2;  // threads, at least 1

  // kInvalidArgument names one that is no number or out of its range, of these and of those of the
  // rooms below that a merge itself divides by or counts with.
  Status Validate() const;
};

}  // namespace atlas
