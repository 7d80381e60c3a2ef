// What a merge makes of sessions and finds between them, in a folder: submaps, and what came of
// matching them. A merge that was ended goes on where it was, and one with a new session looks at
// that alone. It is a memory of pure functions: without it a merge comes to the same, later.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "client/merge/memory/work_record.h"
#include "core/alignment/submap.h"
#include "core/base/status.h"
#include "core/geometry/pose.h"

namespace atlas {

// How far members of a submap may be from where they were fused.
struct ShapeTolerance {
  double metres = 0.0;
  double rad = 0.0;
};

struct SubmapSketch {
  SubmapName name;
  std::vector<SubmapPlace> places;
};

// Whether two searches come to the same: as far around starts within 0.5 m and 2 degrees.
bool IsSameSearch(const SearchReach& one,
                  const Pose& T_a_b_one,
                  const SearchReach& other,
                  const Pose& T_a_b_other);

// Thread-safe.
class MergeWork {
 public:
  // Makes the folder if there is none. `rules`: of how submaps are matched; what was found by other
  // rules is forgotten. Beyond `max_bytes` the submaps that nobody asked for the longest go.
  // kConflict: another program works in it. Else errors are those of the disk.
  static Result<MergeWork> Open(const std::filesystem::path& folder,
                                std::uint64_t rules,
                                std::uint64_t max_bytes);
  // A folder of its own among the system's temporary ones, which goes with it.
  static Result<MergeWork> Temporary();

  MergeWork(MergeWork&&) noexcept;
  MergeWork& operator=(MergeWork&&) noexcept;
  MergeWork(const MergeWork&) = delete;
  MergeWork& operator=(const MergeWork&) = delete;
  ~MergeWork();

  // None where the session was not cut yet.
  std::optional<std::vector<SubmapCut>> FindCut(std::uint64_t session) const;
  Status KeepCut(const CutRecord& cut);

  // Whether the two, as FindCut has them, were looked for in each other, in either order.
  bool WereSearched(std::uint64_t one, std::uint64_t other) const;
  Status KeepSearched(std::uint64_t one, std::uint64_t other);

  // Of this content the one whose members lie nearest `T_submap_member`, if all lie as near as
  // `tolerance`, and if what is in its file is what was written there.
  std::optional<SubmapSketch> FindSubmap(std::uint64_t content,
                                         std::span<const Pose> T_submap_member,
                                         const ShapeTolerance& tolerance) const;
  // As all that is kept: kResourceExhausted on a full disk, else what the disk said.
  Result<SubmapSketch> KeepSubmap(std::uint64_t content,
                                  std::span<const Pose> T_submap_member,
                                  const Submap& submap);
  // Of a sketch. kNotFound, kInvalidData: somebody changed the folder meanwhile; what is damaged is
  // removed, so that it is made anew the next time.
  Result<Submap> LoadSubmap(const SubmapName& name) const;

  // From this start or one so near (0.25 m, 1.5 degrees) that it comes to the same.
  std::optional<SubmapMatch> FindMatch(const SubmapName& a,
                                       const SubmapName& b,
                                       const Pose& T_a_b_start) const;
  Status KeepMatch(const MatchRecord& match);
  // IsSameSearch, whatever the shapes.
  std::optional<SearchRecord> FindSearch(std::uint64_t a,
                                         std::uint64_t b,
                                         const Pose& T_a_b_start,
                                         const SearchReach& reach) const;
  Status KeepSearch(const SearchRecord& search);

 private:
  struct Folder;
  explicit MergeWork(std::unique_ptr<Folder> folder);

  std::unique_ptr<Folder> folder_;
};

}  // namespace atlas
