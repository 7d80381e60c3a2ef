#include "server/service/fusion/survey_cache.h"

#include <algorithm>
#include <utility>

namespace atlas {
namespace {

constexpr std::chrono::minutes kIdle{1};  // the vehicles are gone, most likely

}  // namespace

std::optional<SurveyCache::Shelf::Entry> SurveyCache::Shelf::Take(std::uint64_t key) {
  const auto found = by_key.find(key);
  if (found == by_key.end()) {
    return std::nullopt;
  }
  Entry entry = std::move(*found->second);
  bytes -= entry.bytes;
  by_age.erase(found->second);
  by_key.erase(found);
  return entry;
}

void SurveyCache::Shelf::Put(KeptSurveys kept, Time used_at) {
  const std::uint64_t key = kept.surveys.id().Key();
  Take(key);  // another worker's, whose lease ran out
  const std::size_t size = kept.surveys.bytes();
  const auto place = std::find_if(by_age.begin(), by_age.end(),
                                  [&](const Entry& entry) { return entry.used_at <= used_at; });
  by_key[key] = by_age.insert(place, {std::move(kept), size, used_at});
  bytes += size;
}

std::optional<SurveyCache::Shelf::Entry> SurveyCache::Shelf::TakeOldestAbove(std::size_t limit) {
  if (bytes <= limit || by_age.empty()) {
    return std::nullopt;
  }
  return Take(by_age.back().kept.surveys.id().Key());
}

std::optional<SurveyCache::Shelf::Entry> SurveyCache::Shelf::TakeIdle(Time before) {
  const auto idle = std::find_if(by_age.rbegin(), by_age.rend(), [](const Entry& entry) {
    return entry.kept.revision != entry.kept.revision_on_disk;
  });
  if (idle == by_age.rend() || idle->used_at >= before) {
    return std::nullopt;
  }
  return Take(idle->kept.surveys.id().Key());
}

std::optional<KeptSurveys> SurveyCache::Take(const TileId& id) {
  std::optional<Shelf::Entry> entry;
  {
    const std::lock_guard lock(mutex_);
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
  std::unique_lock lock(mutex_);
  plain_.Put(std::move(kept), std::chrono::steady_clock::now());
  while (auto oldest = plain_.TakeOldestAbove(limits_.plain_bytes)) {
    lock.unlock();
    oldest->kept.surveys.Pack();  // takes milliseconds
    lock.lock();
    packed_.Put(std::move(oldest->kept), oldest->used_at);
  }
  while (auto oldest = packed_.TakeOldestAbove(limits_.packed_bytes)) {
    lock.unlock();
    files_.Write(oldest->kept);
    lock.lock();
  }
}

bool SurveyCache::StoreIdle() {
  const Time before = std::chrono::steady_clock::now() - kIdle;
  for (Shelf* shelf : {&plain_, &packed_}) {
    std::unique_lock lock(mutex_);
    if (auto idle = shelf->TakeIdle(before)) {
      lock.unlock();
      const bool is_stored = files_.Write(idle->kept);
      lock.lock();
      if (!shelf->by_key.contains(idle->kept.surveys.id().Key())) {  // else made anew meanwhile
        shelf->Put(std::move(idle->kept), idle->used_at);
      }
      return is_stored;
    }
  }
  return false;
}

void SurveyCache::MoveToDisk() {
  for (Shelf* shelf : {&packed_, &plain_}) {  // the oldest first
    std::unique_lock lock(mutex_);
    while (auto oldest = shelf->TakeOldestAbove(0)) {
      lock.unlock();
      files_.Write(oldest->kept);
      lock.lock();
    }
  }
}

std::size_t SurveyCache::bytes() const {
  const std::lock_guard lock(mutex_);
  return plain_.bytes + packed_.bytes;
}

}  // namespace atlas
