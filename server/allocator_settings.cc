// How jemalloc works in the daemon (docs/decisions/0414-whose-memory.md). The name is jemalloc's:
// it reads the text when the process starts.
//
// Two arenas for all threads: with one of its own each, what the caches gave up in one is no use to
// the others. What is free goes back to the system after two seconds, also when nobody asks for
// memory meanwhile.
extern "C" {
extern const char* malloc_conf;
const char* malloc_conf =
    "narenas:2,dirty_decay_ms:2000,muzzy_decay_ms:0,background_thread:true,max_background_threads:"
    "1";
}
