/* deflate.c: literals, runs and Huffman codes; see deflate.h. */
#include "image/deflate.h"

#include <string.h>

#define LITERAL_CODES 286 /* 256 bytes, end of block, 29 lengths */
#define END_OF_BLOCK 256
#define LONGEST_CODE 12 /* of 15; bounds the output closer and costs nothing measurable */
#define SHORTEST_RUN 4  /* 3 gains nothing: residues around runs have short codes */
#define LONGEST_RUN 258
#define ADLER_MODULUS 65521u
#define ADLER_STRIDE 5552 /* additions until 32 bits could overflow (RFC 1950, §9) */

/* A token is a literal byte, or LENGTH_TOKEN + the length of a run. */
#define LENGTH_TOKEN 256
#define TOKENS (LENGTH_TOKEN + LONGEST_RUN + 1)

/* RFC 1951, §3.2.5. */
static const uint16_t length_base[29] = {3,  4,  5,  6,   7,   8,   9,   10,  11, 13,
                                         15, 17, 19, 23,  27,  31,  35,  43,  51, 59,
                                         67, 83, 99, 115, 131, 163, 195, 227, 258};
static const uint8_t length_extra[29] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,
                                         2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};

typedef struct code {
    uint32_t bits;
    uint32_t count;
} code;

size_t vd_deflate_begin(vd_deflate *deflate, uint8_t *out) {
    memset(deflate, 0, sizeof *deflate);
    deflate->adler_low = 1;
    out[0] = 0x78; /* deflate, 32 KiB window */
    out[1] = 0x01; /* fastest; makes the pair a multiple of 31 */
    return 2;
}

size_t vd_deflate_bound(size_t size_bytes) {
    /* LONGEST_CODE bits a literal; a run costs less than the four literals it replaces. The rest is
     * for the header, the end and what a flush writes too much. */
    return size_bytes * LONGEST_CODE / 8 + 256;
}

/* Writes the whole bytes among the bits, in one store of eight of which the rest is overwritten by
 * the next. Without a branch: its misses took a third of all the time. */
static inline uint8_t *flush(uint64_t *bits, uint32_t *bit_count, uint8_t *out) {
    for (int i = 0; i < 8; i++) {
        out[i] = (uint8_t)(*bits >> (8 * i));
    }
    out += *bit_count / 8;
    *bits >>= *bit_count & ~7u;
    *bit_count &= 7;
    return out;
}

static void put(vd_deflate *deflate, uint8_t **out, uint32_t bits, uint32_t count) {
    deflate->bits |= (uint64_t)bits << deflate->bit_count;
    deflate->bit_count += count;
    *out = flush(&deflate->bits, &deflate->bit_count, *out);
}

/* As put, for many tokens, two at a time (at most 7 + 2 · 18 bits) and with the state in
 * registers. */
static uint8_t *put_tokens(vd_deflate *deflate, uint8_t *out, const uint16_t *tokens, size_t count,
                           const code codes[TOKENS]) {
    uint64_t bits = deflate->bits;
    uint32_t bit_count = deflate->bit_count;
    for (size_t i = 0; i + 2 <= count; i += 2) {
        const code first = codes[tokens[i]], second = codes[tokens[i + 1]];
        bits |= (uint64_t)first.bits << bit_count;
        bits |= (uint64_t)second.bits << (bit_count + first.count);
        bit_count += first.count + second.count;
        out = flush(&bits, &bit_count, out);
    }
    deflate->bits = bits;
    deflate->bit_count = bit_count;
    if (count % 2 == 1) {
        const code last = codes[tokens[count - 1]];
        put(deflate, &out, last.bits, last.count);
    }
    return out;
}

static void add_checksum(vd_deflate *deflate, const uint8_t *data, size_t size_bytes) {
    uint32_t low = deflate->adler_low, high = deflate->adler_high;
    while (size_bytes > 0) {
        const size_t count = size_bytes < ADLER_STRIDE ? size_bytes : ADLER_STRIDE;
        for (size_t i = 0; i < count; i++) {
            low += data[i];
            high += low;
        }
        low %= ADLER_MODULUS;
        high %= ADLER_MODULUS;
        data += count;
        size_bytes -= count;
    }
    deflate->adler_low = low;
    deflate->adler_high = high;
}

/* Cuts data into tokens and counts them. Returns their number. Neighbours are counted in two
 * tables, so that equal ones do not wait for each other's store. */
static size_t tokenize(const uint8_t *data, size_t size_bytes, uint16_t *tokens,
                       uint32_t frequency[TOKENS]) {
    uint32_t other[TOKENS] = {0};
    tokens[0] = data[0];
    frequency[data[0]]++;
    size_t count = 1, i = 1;
    while (i < size_bytes) {
        uint32_t next, before;
        memcpy(&next, data + i, sizeof next);
        memcpy(&before, data + i - 1, sizeof before);
        uint32_t token = data[i];
        if (next == before && size_bytes - i >= SHORTEST_RUN) { /* five equal bytes */
            const size_t most = size_bytes - i < LONGEST_RUN ? size_bytes - i : LONGEST_RUN;
            size_t length = SHORTEST_RUN;
            while (length < most && data[i + length] == token) {
                length++;
            }
            token = LENGTH_TOKEN + (uint32_t)length;
            i += length;
        } else {
            i++;
        }
        (count & 1 ? other : frequency)[token]++;
        tokens[count++] = (uint16_t)token;
    }
    for (int token = 0; token < TOKENS; token++) {
        frequency[token] += other[token];
    }
    return count;
}

/* Sorts the used symbols by frequency, then number. Returns how many there are. */
static int sort_symbols(const uint32_t frequency[LITERAL_CODES], uint16_t order[LITERAL_CODES]) {
    int used = 0;
    for (int symbol = 0; symbol < LITERAL_CODES; symbol++) {
        if (frequency[symbol] == 0) {
            continue;
        }
        int at = used++;
        for (; at > 0 && frequency[order[at - 1]] > frequency[symbol]; at--) {
            order[at] = order[at - 1];
        }
        order[at] = (uint16_t)symbol;
    }
    return used;
}

/* Builds the Huffman tree of at least two symbols; returns the greatest depth. Leaves and inner
 * nodes each come in ascending weight, so two queues replace the heap (van Leeuwen 1976). */
static int huffman_depths(const uint32_t frequency[LITERAL_CODES], uint8_t depth[LITERAL_CODES]) {
    uint16_t order[LITERAL_CODES];
    const int leaves = sort_symbols(frequency, order);
    uint32_t weight[2 * LITERAL_CODES];
    uint16_t parent[2 * LITERAL_CODES];
    uint8_t level[2 * LITERAL_CODES];
    for (int i = 0; i < leaves; i++) {
        weight[i] = frequency[order[i]];
    }
    const int root = 2 * leaves - 2;
    int leaf = 0, inner = leaves;
    for (int node = leaves; node <= root; node++) {
        weight[node] = 0;
        for (int child = 0; child < 2; child++) {
            const bool take_leaf =
                leaf < leaves && (inner == node || weight[leaf] <= weight[inner]);
            const int lightest = take_leaf ? leaf++ : inner++;
            weight[node] += weight[lightest];
            parent[lightest] = (uint16_t)node;
        }
    }
    int deepest = 0;
    level[root] = 0;
    for (int node = root - 1; node >= 0; node--) {
        level[node] = (uint8_t)(level[parent[node]] + 1);
        if (node < leaves) {
            depth[order[node]] = level[node];
            deepest = level[node] > deepest ? level[node] : deepest;
        }
    }
    return deepest;
}

/* Code lengths of at most LONGEST_CODE: weights are flattened until the tree is shallow enough. */
static void code_lengths(uint32_t frequency[LITERAL_CODES], uint8_t lengths[LITERAL_CODES]) {
    memset(lengths, 0, LITERAL_CODES);
    while (huffman_depths(frequency, lengths) > LONGEST_CODE) {
        for (int symbol = 0; symbol < LITERAL_CODES; symbol++) {
            frequency[symbol] = (frequency[symbol] + 1) / 2;
        }
    }
}

/* Canonical codes (RFC 1951, §3.2.2), their bits reversed as the stream wants them. */
static void assign_codes(const uint8_t lengths[LITERAL_CODES], code codes[LITERAL_CODES]) {
    uint32_t next = 0;
    for (uint32_t length = 1; length <= LONGEST_CODE; length++) {
        for (int symbol = 0; symbol < LITERAL_CODES; symbol++) {
            if (lengths[symbol] != length) {
                continue;
            }
            uint32_t reversed = 0;
            for (uint32_t bit = 0; bit < length; bit++) {
                reversed |= (next >> bit & 1u) << (length - 1 - bit);
            }
            codes[symbol].bits = reversed;
            codes[symbol].count = length;
            next++;
        }
        next <<= 1;
    }
}

/* The block's header: all code lengths in plain four bits each. Run-length coding them, as the
 * format allows, would save a hundred bytes of a block. */
static void put_header(vd_deflate *deflate, uint8_t **out, const uint8_t lengths[LITERAL_CODES],
                       bool last) {
    put(deflate, out, last, 1);
    put(deflate, out, 2, 2); /* dynamic codes */
    put(deflate, out, LITERAL_CODES - 257, 5);
    put(deflate, out, 2 - 1, 5); /* two distance codes: one alone is an oddity */
    put(deflate, out, 19 - 4, 4);
    for (int i = 0; i < 19; i++) {
        put(deflate, out, i < 3 ? 0 : 4, 3); /* the first three are the repeat codes */
    }
    for (int symbol = 0; symbol < LITERAL_CODES + 2; symbol++) {
        const uint32_t n = symbol < LITERAL_CODES ? lengths[symbol] : 1;
        const uint32_t reversed = (n & 1) << 3 | (n & 2) << 1 | (n & 4) >> 1 | (n & 8) >> 3;
        put(deflate, out, reversed, 4);
    }
}

/* Codes of whole tokens: of a run its length code, extra bits and distance code in one piece. */
static void token_codes(uint32_t frequency[TOKENS], uint8_t lengths[LITERAL_CODES],
                        code codes[TOKENS], code *end) {
    uint8_t length_code[LONGEST_RUN + 1];
    int next = 0;
    for (int length = 3; length <= LONGEST_RUN; length++) {
        next += next < 28 && length >= length_base[next + 1];
        length_code[length] = (uint8_t)next;
    }
    uint32_t symbol_frequency[LITERAL_CODES] = {0};
    code symbols[LITERAL_CODES] = {{0, 0}};
    memcpy(symbol_frequency, frequency, 256 * sizeof frequency[0]);
    symbol_frequency[END_OF_BLOCK] = 1;
    for (int length = SHORTEST_RUN; length <= LONGEST_RUN; length++) {
        symbol_frequency[257 + length_code[length]] += frequency[LENGTH_TOKEN + length];
    }
    code_lengths(symbol_frequency, lengths);
    assign_codes(lengths, symbols);
    memcpy(codes, symbols, 256 * sizeof codes[0]);
    *end = symbols[END_OF_BLOCK];
    for (int length = SHORTEST_RUN; length <= LONGEST_RUN; length++) {
        const int which = length_code[length];
        const code symbol = symbols[257 + which];
        code *out = &codes[LENGTH_TOKEN + length];
        out->bits = symbol.bits | (uint32_t)(length - length_base[which]) << symbol.count;
        out->count = symbol.count + length_extra[which] + 1; /* distance 1 is the code 0 */
    }
}

size_t vd_deflate_block(vd_deflate *deflate, const uint8_t *data, size_t size_bytes, bool last,
                        uint16_t *tokens, uint8_t *out) {
    uint32_t frequency[TOKENS] = {0};
    uint8_t lengths[LITERAL_CODES];
    code codes[TOKENS], end;
    uint8_t *at = out;
    add_checksum(deflate, data, size_bytes);
    const size_t count = tokenize(data, size_bytes, tokens, frequency);
    token_codes(frequency, lengths, codes, &end);
    put_header(deflate, &at, lengths, last);
    at = put_tokens(deflate, at, tokens, count, codes);
    put(deflate, &at, end.bits, end.count);
    if (last) {
        if (deflate->bit_count > 0) {
            *at++ = (uint8_t)deflate->bits;
        }
        const uint32_t adler = deflate->adler_high << 16 | deflate->adler_low;
        for (int shift = 24; shift >= 0; shift -= 8) {
            *at++ = (uint8_t)(adler >> shift);
        }
    }
    return (size_t)(at - out);
}
