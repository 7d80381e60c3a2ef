// What a merge keeps for the next one, as records of a log.
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "client/merge/memory/submap_name.h"
#include "core/alignment/session_cut.h"
#include "core/alignment/submap.h"
#include "core/alignment/submap_match.h"
#include "core/base/bytes.h"
#include "core/geometry/pose.h"
#include "core/localization/registration/pose_search.h"

namespace atlas {

// A submap that lies in a file.
struct SubmapRecord {
  SubmapName name;
  std::vector<Pose> T_submap_member;
  std::vector<SubmapPlace> places;
};

// What came of matching two submaps from a start.
struct MatchRecord {
  SubmapName a;
  SubmapName b;
  Pose T_a_b_start = Pose::Identity();
  SubmapMatch match;
};

// Where one was found around a start, if it was: of any shape, for it was only looked for.
struct SearchRecord {
  std::uint64_t a = 0;  // contents
  std::uint64_t b = 0;
  Pose T_a_b_start = Pose::Identity();
  SearchReach reach;
  std::optional<Pose> T_a_b;
};

// How a session was cut.
struct CutRecord {
  std::uint64_t session = 0;  // Hash64 of its keyframes and of how it was cut
  std::vector<SubmapCut> cuts;
};

// Two sessions that were looked for in each other by what they look like, wherever that is.
struct PairRecord {
  std::uint64_t a = 0;  // as CutRecord's, the lesser first
  std::uint64_t b = 0;
};

using WorkRecord = std::variant<SubmapRecord, MatchRecord, SearchRecord, CutRecord, PairRecord>;

Bytes EncodeRecord(const WorkRecord& record);
// None: they are no record's.
std::optional<WorkRecord> DecodeRecord(ByteSpan bytes);

}  // namespace atlas
