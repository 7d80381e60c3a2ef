#include "client/merge/memory/merge_work.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include "client/merge/memory/temporary_folder.h"
#include "client/merge/memory/work_log.h"
#include "client/vehicle/folder_lock.h"
#include "client/vehicle/stored_file.h"
#include "core/alignment/submap_codec.h"
#include "core/base/disk_error.h"
#include "core/base/hash.h"
#include "core/base/str_cat.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxSubmapBytes = 256U << 20U;
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::string_view kSuffix = ".submap";

struct Nearness {
  double metres;
  double rad;
};
constexpr Nearness kSameMatch{0.25, 1.5 * kDegree};
constexpr Nearness kSameSearch{0.5, 2.0 * kDegree};

bool IsNear(const Pose& one, const Pose& other, const Nearness& nearness) {
  return (one.translation() - other.translation()).norm() <= nearness.metres &&
         Eigen::Quaterniond(one.linear()).angularDistance(Eigen::Quaterniond(other.linear())) <=
             nearness.rad;
}

// The farthest of them, for choosing; none where one is further off than tolerated.
std::optional<double> MisfitOf(std::span<const Pose> one,
                               std::span<const Pose> other,
                               const Nearness& nearness) {
  if (one.size() != other.size()) return std::nullopt;
  double worst = 0.0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    if (!IsNear(one[i], other[i], nearness)) return std::nullopt;
    worst = std::max(worst, (one[i].translation() - other[i].translation()).norm());
  }
  return worst;
}

// The record with the least misfit, the first of equals; null where none has any.
template <typename Record, typename Misfit>
const Record* Nearest(const std::vector<Record>& records, const Misfit& misfit_of) {
  const Record* nearest = nullptr;
  double least = 0.0;
  for (const Record& record : records) {
    const std::optional<double> misfit = misfit_of(record);
    if (!misfit || (nearest != nullptr && *misfit >= least)) continue;
    nearest = &record;
    least = *misfit;
  }
  return nearest;
}

std::span<const Pose> One(const Pose& pose) {
  return {&pose, 1};
}

std::string Hex(std::uint64_t value) {
  std::array<char, 16> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, 16).ptr;
  return {digits.data(), end};
}

std::uint64_t ShapeOf(std::span<const Pose> T_submap_member) {
  Hash64Stream hash;
  for (const Pose& pose : T_submap_member) {
    hash.Add({reinterpret_cast<const std::uint8_t*>(pose.data()), 16 * sizeof(double)});
  }
  return hash.value();
}

// Or what is left of the writing of one.
bool IsSubmapFile(const fs::path& path) {
  return path.extension() == kSuffix ||
         (path.extension() == kPartialSuffix && path.stem().extension() == kSuffix);
}

}  // namespace

bool IsSameSearch(const SearchReach& one,
                  const Pose& T_a_b_one,
                  const SearchReach& other,
                  const Pose& T_a_b_other) {
  return one.along_m == other.along_m && one.beside_m == other.beside_m &&
         one.yaw_rad == other.yaw_rad && one.direction_rad == other.direction_rad &&
         IsNear(T_a_b_one, T_a_b_other, kSameSearch);
}

struct MergeWork::Folder {
  fs::path path;
  bool is_temporary = false;
  std::optional<FolderLock> lock = std::nullopt;
  std::mutex mutex = {};
  std::optional<WorkLog> log = std::nullopt;
  std::map<std::uint64_t, std::vector<SubmapRecord>> submaps = {};
  std::map<std::pair<SubmapName, SubmapName>, std::vector<MatchRecord>> matches = {};
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::vector<SearchRecord>> searches = {};
  std::map<std::uint64_t, std::vector<SubmapCut>> cuts = {};
  std::set<std::pair<std::uint64_t, std::uint64_t>> searched = {};
  std::set<SubmapName> whole = {};  // looked at, or written by this program

  fs::path PathOf(const SubmapName& name) const {
    return path / StrCat(Hex(name.content), "-", Hex(name.shape), kSuffix);
  }

  void Learn(const SubmapRecord& record) { submaps[record.name.content].push_back(record); }
  void Learn(const MatchRecord& record) { matches[{record.a, record.b}].push_back(record); }
  void Learn(const SearchRecord& record) { searches[{record.a, record.b}].push_back(record); }
  void Learn(const CutRecord& record) { cuts[record.session] = record.cuts; }
  void Learn(const PairRecord& record) { searched.emplace(record.a, record.b); }

  Status Keep(const WorkRecord& record) {
    const std::lock_guard guard(mutex);
    std::visit([this](const auto& one) { Learn(one); }, record);
    return log->Append(EncodeRecord(record));
  }

  bool IsWhole(const SubmapName& name);
  Status Open(std::uint64_t rules, std::uint64_t max_bytes);
  Result<std::set<fs::path>> Tidy(const std::set<fs::path>& known, std::uint64_t max_bytes) const;
};

// One that is not is removed: after a loss of power a file may be damaged.
bool MergeWork::Folder::IsWhole(const SubmapName& name) {
  if (whole.contains(name)) return true;
  const fs::path file = PathOf(name);
  const auto bytes = LoadFile(file, kMaxSubmapBytes);
  if (bytes && AreSubmap(*bytes)) return whole.insert(name).second;
  std::error_code ignored;
  fs::remove(file, ignored);
  return false;
}

// The submaps' files that are there: of those that are `known` the latest ones; others are removed.
Result<std::set<fs::path>> MergeWork::Folder::Tidy(const std::set<fs::path>& known,
                                                   std::uint64_t max_bytes) const {
  struct File {
    fs::file_time_type used;
    fs::path path;
    std::uint64_t bytes;
  };
  std::vector<File> files;
  std::error_code error;
  fs::directory_iterator entry(path, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code gone;
    if (!IsSubmapFile(entry->path())) continue;
    files.push_back({entry->last_write_time(gone), entry->path(), entry->file_size(gone)});
  }
  if (error) return Error(DiskError("cannot read", path, error.value()));
  std::sort(files.begin(), files.end(),
            [](const File& one, const File& other) { return one.used > other.used; });
  std::set<fs::path> kept;
  std::uint64_t bytes = 0;
  for (const File& file : files) {
    bytes += file.bytes;
    if (known.contains(file.path) && bytes <= max_bytes) {
      kept.insert(file.path);
    } else if (!fs::remove(file.path, error) && error) {
      return Error(DiskError("cannot remove", file.path, error.value()));
    }
  }
  return kept;
}

// Records of submaps whose files are gone are forgotten, and what was found with them.
Status MergeWork::Folder::Open(std::uint64_t rules, std::uint64_t max_bytes) {
  const fs::path file = path / StrCat("found-", Hex(rules), ".log");
  std::vector<WorkRecord> records;
  std::set<fs::path> known;
  auto opened = WorkLog::Open(file, [&](ByteSpan bytes) {
    auto record = DecodeRecord(bytes);
    if (!record) return false;
    if (const auto* submap = std::get_if<SubmapRecord>(&*record)) {
      known.insert(PathOf(submap->name));
    }
    records.push_back(*std::move(record));
    return true;
  });
  if (!opened) return opened.error();
  const auto kept = Tidy(known, max_bytes);
  if (!kept) return kept.error();
  std::set<SubmapName> names;
  std::set<std::uint64_t> contents;
  for (const WorkRecord& record : records) {
    const auto* submap = std::get_if<SubmapRecord>(&record);
    if (submap == nullptr || !kept->contains(PathOf(submap->name))) continue;
    names.insert(submap->name);
    contents.insert(submap->name.content);
  }
  const auto is_of_use = [&](const WorkRecord& record) {
    if (const auto* submap = std::get_if<SubmapRecord>(&record))
      return names.contains(submap->name);
    if (const auto* match = std::get_if<MatchRecord>(&record)) {
      return names.contains(match->a) && names.contains(match->b);
    }
    const auto* search = std::get_if<SearchRecord>(&record);
    return search == nullptr || (contents.contains(search->a) && contents.contains(search->b));
  };
  const auto forgotten =
      std::erase_if(records, [&](const WorkRecord& record) { return !is_of_use(record); });
  for (const WorkRecord& record : records) {
    std::visit([this](const auto& one) { Learn(one); }, record);
  }
  log = *std::move(opened);
  if (forgotten <= records.size()) return {};
  // Mostly what is forgotten: written anew.
  log.reset();
  std::error_code error;
  if (!fs::remove(file, error) && error) return DiskError("cannot remove", file, error.value());
  opened = WorkLog::Open(file, [](ByteSpan) { return true; });
  if (!opened) return opened.error();
  log = *std::move(opened);
  for (const WorkRecord& record : records) {
    ATLAS_RETURN_IF_ERROR(log->Append(EncodeRecord(record)));
  }
  return {};
}

MergeWork::MergeWork(std::unique_ptr<Folder> folder) : folder_(std::move(folder)) {}
MergeWork::MergeWork(MergeWork&&) noexcept = default;
MergeWork& MergeWork::operator=(MergeWork&&) noexcept = default;

MergeWork::~MergeWork() {
  if (folder_ == nullptr || !folder_->is_temporary) return;
  const fs::path path = folder_->path;
  folder_.reset();
  std::error_code ignored;  // the system removes it some day
  fs::remove_all(path, ignored);
}

Result<MergeWork> MergeWork::Open(const fs::path& folder,
                                  std::uint64_t rules,
                                  std::uint64_t max_bytes) {
  if (Status status = MakeFolder(folder); !status.ok()) return Error(std::move(status));
  Result<FolderLock> lock = FolderLock::Take(folder);
  if (!lock) return Error(lock.error());
  auto opened = std::make_unique<Folder>();
  opened->path = folder;
  opened->lock = *std::move(lock);
  if (Status status = opened->Open(rules, max_bytes); !status.ok()) return Error(std::move(status));
  return MergeWork(std::move(opened));
}

Result<MergeWork> MergeWork::Temporary() {
  std::error_code error;
  const fs::path among = fs::temp_directory_path(error);
  if (error) return Error(DiskError("cannot find", "the temporary folder", error.value()));
  auto made = MakeTemporaryFolder({among, "atlas-merge.", std::chrono::hours(1)});
  if (!made) return Error(made.error());
  auto folder = std::make_unique<Folder>();
  folder->path = made->path;
  folder->lock = std::move(made->lock);
  folder->is_temporary = true;
  MergeWork work(std::move(folder));
  if (Status status = work.folder_->Open(0, 0); !status.ok()) return Error(std::move(status));
  return work;
}

std::optional<std::vector<SubmapCut>> MergeWork::FindCut(std::uint64_t session) const {
  const std::lock_guard guard(folder_->mutex);
  const auto found = folder_->cuts.find(session);
  return found == folder_->cuts.end() ? std::nullopt : std::optional(found->second);
}

Status MergeWork::KeepCut(const CutRecord& cut) {
  return folder_->Keep(cut);
}

bool MergeWork::WereSearched(std::uint64_t one, std::uint64_t other) const {
  const std::lock_guard guard(folder_->mutex);
  return folder_->searched.contains(std::minmax(one, other));
}

Status MergeWork::KeepSearched(std::uint64_t one, std::uint64_t other) {
  if (WereSearched(one, other)) return {};
  return folder_->Keep(PairRecord{std::min(one, other), std::max(one, other)});
}

std::optional<SubmapSketch> MergeWork::FindSubmap(std::uint64_t content,
                                                  std::span<const Pose> T_submap_member,
                                                  const ShapeTolerance& tolerance) const {
  const std::lock_guard guard(folder_->mutex);
  const auto found = folder_->submaps.find(content);
  if (found == folder_->submaps.end()) return std::nullopt;
  const auto* const nearest = Nearest(found->second, [&](const SubmapRecord& record) {
    const auto misfit =
        MisfitOf(record.T_submap_member, T_submap_member, {tolerance.metres, tolerance.rad});
    return misfit && folder_->IsWhole(record.name) ? misfit : std::nullopt;
  });
  if (nearest == nullptr) return std::nullopt;
  std::error_code ignored;  // it was asked for, and others go before it if that can be told
  fs::last_write_time(folder_->PathOf(nearest->name), fs::file_time_type::clock::now(), ignored);
  return SubmapSketch{nearest->name, nearest->places};
}

Result<SubmapSketch> MergeWork::KeepSubmap(std::uint64_t content,
                                           std::span<const Pose> T_submap_member,
                                           const Submap& submap) {
  SubmapRecord record{{content, ShapeOf(T_submap_member)},
                      {T_submap_member.begin(), T_submap_member.end()},
                      submap.places()};
  Status status = StoreFile(folder_->PathOf(record.name), submap.Encode(), Durability::kWhole);
  if (status.ok()) status = folder_->Keep(record);
  if (!status.ok()) return Error(std::move(status));
  const std::lock_guard guard(folder_->mutex);
  folder_->whole.insert(record.name);
  return SubmapSketch{record.name, std::move(record.places)};
}

Result<Submap> MergeWork::LoadSubmap(const SubmapName& name) const {
  const fs::path path = folder_->PathOf(name);
  const auto bytes = LoadFile(path, kMaxSubmapBytes);
  Result<Submap> submap = bytes ? Submap::Decode(*bytes) : Error(bytes.error());
  if (submap) return submap;
  const std::lock_guard guard(folder_->mutex);
  folder_->whole.erase(name);
  if (submap.error().code() != StatusCode::kInvalidData) return submap;
  std::error_code ignored;  // then it is damaged the next time, too
  fs::remove(path, ignored);
  return Error(submap.error().WithContext(path.string()));
}

std::optional<SubmapMatch> MergeWork::FindMatch(const SubmapName& a,
                                                const SubmapName& b,
                                                const Pose& T_a_b_start) const {
  const std::lock_guard guard(folder_->mutex);
  const auto found = folder_->matches.find({a, b});
  if (found == folder_->matches.end()) return std::nullopt;
  const auto* const nearest = Nearest(found->second, [&](const MatchRecord& record) {
    return MisfitOf(One(record.T_a_b_start), One(T_a_b_start), kSameMatch);
  });
  return nearest == nullptr ? std::nullopt : std::optional(nearest->match);
}

Status MergeWork::KeepMatch(const MatchRecord& match) {
  return folder_->Keep(match);
}

std::optional<SearchRecord> MergeWork::FindSearch(std::uint64_t a,
                                                  std::uint64_t b,
                                                  const Pose& T_a_b_start,
                                                  const SearchReach& reach) const {
  const std::lock_guard guard(folder_->mutex);
  const auto found = folder_->searches.find({a, b});
  if (found == folder_->searches.end()) return std::nullopt;
  const auto* const nearest = Nearest(found->second, [&](const SearchRecord& record) {
    return IsSameSearch(record.reach, record.T_a_b_start, reach, T_a_b_start)
               ? MisfitOf(One(record.T_a_b_start), One(T_a_b_start), kSameSearch)
               : std::nullopt;
  });
  return nearest == nullptr ? std::nullopt : std::optional(*nearest);
}

Status MergeWork::KeepSearch(const SearchRecord& search) {
  return folder_->Keep(search);
}

}  // namespace atlas
