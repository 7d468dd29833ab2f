// A QEMU plugin that counts the instructions that the emulated program executes in all its threads, and writes the
// number to the file named by its argument `out=` when the program exits. tests/measure/count_instructions builds and
// loads it.
//
// Debian's qemu-user loads plugins but ships no header for them, so the used part of QEMU's interface
// (docs/devel/tcg-plugins; version 1, as of the QEMU 7.2 of Debian 12) is declared here.
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef uint64_t PluginId;
struct qemu_plugin_tb;
enum { no_registers = 0 };

size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb* block);
void qemu_plugin_register_vcpu_tb_trans_cb(PluginId id, void (*translated)(PluginId, struct qemu_plugin_tb*));
void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb* block, void (*executed)(unsigned, void*),
                                          int registers, void* data);
void qemu_plugin_register_atexit_cb(PluginId id, void (*ended)(PluginId, void*), void* data);

#define EXPORT __attribute__((visibility("default")))

EXPORT int qemu_plugin_version = 1;

// One counter per thread, in separate cache lines, so that threads do not contend.
enum { max_threads = 1024 };
static struct { _Alignas(64) uint64_t instructions; } counts[max_threads];
static const char* out;

static void executed(unsigned thread, void* instructions) {
  if (thread >= max_threads) {
    fprintf(stderr, "instruction_counter: more than %d threads at once\n", max_threads);
    abort();
  }
  counts[thread].instructions += (uintptr_t)instructions;
}

// A block has one entry, and is left early only by a signal raised by one of its instructions.
static void translated(PluginId id, struct qemu_plugin_tb* block) {
  (void)id;
  qemu_plugin_register_vcpu_tb_exec_cb(block, executed, no_registers, (void*)(uintptr_t)qemu_plugin_tb_n_insns(block));
}

static void ended(PluginId id, void* data) {
  (void)id;
  (void)data;
  uint64_t sum = 0;
  for (int k = 0; k < max_threads; ++k) sum += counts[k].instructions;
  FILE* file = fopen(out, "w");
  if (!file || fprintf(file, "%" PRIu64 "\n", sum) < 0 || fclose(file) != 0)
    fprintf(stderr, "instruction_counter: cannot write %s\n", out);
}

EXPORT int qemu_plugin_install(PluginId id, const void* qemu, int argc, char** argv) {
  (void)qemu;
  if (argc != 1 || strncmp(argv[0], "out=", 4) != 0 || !(out = strdup(argv[0] + 4))) {
    fprintf(stderr, "instruction_counter: its one argument is out=FILE\n");
    return 1;
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
  qemu_plugin_register_atexit_cb(id, ended, NULL);
  return 0;
}
