#include "server/service/fusion/survey_cache.h"

#include <utility>

#include "server/service/process_memory.h"

namespace atlas {
namespace {

constexpr std::size_t kMaxLeftFree = std::size_t{128} << 20;

}  // namespace

class SurveyCache::Work {
 public:
  Work(SurveyCache& cache, const Entry& entry, Lock& lock)
      : cache_(cache), key_(entry.kept.surveys.id().Key()), lock_(lock) {
    cache_.at_work_.insert(key_);
    lock_.unlock();
  }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;
  ~Work() {
    lock_.lock();
    cache_.at_work_.erase(key_);
    cache_.done_.notify_all();
  }

 private:
  SurveyCache& cache_;
  std::uint64_t key_;
  Lock& lock_;
};

std::optional<KeptSurveys> SurveyCache::Take(const TileId& id) {
  std::optional<Entry> entry;
  {
    Lock lock(mutex_);
    done_.wait(lock, [&] { return !at_work_.contains(id.Key()); });
    entry = plain_.Take(id.Key());
    if (!entry) {
      entry = packed_.Take(id.Key());
    }
  }
  std::optional<KeptSurveys> kept = entry ? std::move(entry->kept) : files_.Read(id);
  if (kept) {
    kept->surveys.Unpack();
  }
  return kept;
}

void SurveyCache::Put(KeptSurveys kept) {
  const Lock lock(mutex_);
  PutOn(plain_, {std::move(kept), std::chrono::steady_clock::now()});
}

// There are two of a tile if a worker was given up and came back.
void SurveyCache::PutOn(Shelf& shelf, Entry entry) {
  const std::uint64_t key = entry.kept.surveys.id().Key();
  for (Shelf* other : {&plain_, &packed_}) {
    const Entry* its = other->Find(key);
    if (its != nullptr && its->kept.revision > entry.kept.revision) {
      return;
    }
    other->Take(key);
  }
  const std::size_t size = entry.kept.surveys.bytes();
  const Time used_at = entry.used_at;
  shelf.Insert(key, std::move(entry), size,
               [&](const Entry& other) { return other.used_at > used_at; });
}

void SurveyCache::Trim() {
  Lock lock(mutex_);
  while (auto oldest = plain_.TakeOldestAbove(limits_.plain_bytes)) {
    left_free_ += oldest->kept.surveys.bytes();
    {
      const Work work(*this, *oldest, lock);
      oldest->kept.surveys.Pack();  // takes milliseconds
    }
    PutOn(packed_, *std::move(oldest));
  }
  while (const auto oldest = packed_.TakeOldestAbove(limits_.packed_bytes)) {
    left_free_ += oldest->kept.surveys.bytes();
    const Work work(*this, *oldest, lock);
    if (!files_.Has(oldest->kept)) {
      files_.Write(oldest->kept);
    }
  }
  if (left_free_ > kMaxLeftFree) {
    left_free_ = 0;
    lock.unlock();
    ReturnFreeMemory();
  }
}

bool SurveyCache::StoreIdle() {
  const Time before = std::chrono::steady_clock::now() - limits_.idle;
  const auto is_idle = [&](const Entry& entry) {
    return entry.used_at < before && entry.kept.stored_revision != entry.kept.revision;
  };
  Lock lock(mutex_);
  for (Shelf* shelf : {&plain_, &packed_}) {
    if (auto idle = shelf->TakeOldest(is_idle)) {
      bool is_stored = false;
      {
        const Work work(*this, *idle, lock);
        is_stored = files_.Write(idle->kept);
      }
      if (is_stored) {
        idle->kept.stored_revision = idle->kept.revision;
      }
      PutOn(*shelf, *std::move(idle));
      return is_stored;
    }
  }
  return false;
}

std::size_t SurveyCache::MoveToDisk() {
  std::size_t moved_bytes = 0;
  Lock lock(mutex_);
  for (Shelf* shelf : {&packed_, &plain_}) {  // the oldest first
    while (const auto oldest = shelf->TakeOldestAbove(0)) {
      const Work work(*this, *oldest, lock);
      const bool is_on_disk = files_.Has(oldest->kept) || files_.Write(oldest->kept);
      moved_bytes += is_on_disk ? oldest->kept.surveys.bytes() : 0;
    }
  }
  return moved_bytes;
}

std::size_t SurveyCache::bytes() const {
  const Lock lock(mutex_);
  return plain_.bytes() + packed_.bytes();
}

}  // namespace atlas
