/* function_build.c: from operations to a program: constants folded, equal operations shared, what
 * nobody needs left out, registers reused. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/function_kernels.h"

void vd_function_builder_init(vd_function_builder *b) {
    memset(b->hash, 0, sizeof b->hash);
    b->node_count = 2;
    b->full = false;
    memset(b->nodes, 0, 2 * sizeof b->nodes[0]);
    b->nodes[0].op = b->nodes[1].op = VD_NODE_INPUT;
    b->nodes[1].a = 1;
}

static uint32_t bits_of(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static bool same_node(const vd_function_node *a, const vd_function_node *b) {
    return a->op == b->op && a->a == b->a && a->b == b->b && a->c == b->c &&
           bits_of(a->value) == bits_of(b->value);
}

/* Open addressing; the table is at most a quarter full. */
static int add_node(vd_function_builder *b, const vd_function_node *node) {
    uint32_t h = bits_of(node->value) * 0x9E3779B1u + node->op * 0x85EBCA77u;
    h = (h ^ h >> 15) * 0x2C1B3C6Du + node->a * 0xC2B2AE3Du;
    h = (h ^ h >> 13) * 0x297A2D39u + node->b * 0x27D4EB2Fu + node->c * 0x165667B1u;
    uint32_t place = (h ^ h >> 16) & (VD_FUNCTION_HASH - 1);
    while (b->hash[place] != 0) {
        if (same_node(&b->nodes[b->hash[place] - 1], node)) {
            return b->hash[place] - 1;
        }
        place = (place + 1) & (VD_FUNCTION_HASH - 1);
    }
    if (b->node_count == VD_FUNCTION_MAX_STEPS) {
        b->full = true;
        return 0;
    }
    b->nodes[b->node_count] = *node;
    b->hash[place] = (uint16_t)(b->node_count + 1);
    return b->node_count++;
}

int vd_function_constant(vd_function_builder *b, float value) {
    vd_function_node node = {value == value ? value : NAN, VD_NODE_CONSTANT, 0, 0, 0};
    return add_node(b, &node);
}

static int operand_count(vd_function_op op) {
    switch (op) {
    case VD_OP_NEGATE:
    case VD_OP_ABS:
    case VD_OP_FLOOR:
    case VD_OP_SQRT:
    case VD_OP_SIN:
    case VD_OP_COS:
    case VD_OP_TAN:
    case VD_OP_EXP:
    case VD_OP_LOG:
    case VD_OP_NOT:
        return 1;
    case VD_OP_FBM:
    case VD_OP_RIDGED:
    case VD_OP_SELECT:
        return 3;
    default:
        return 2;
    }
}

int vd_function_node_make(vd_function_builder *b, vd_function_op op, int a, int b_, int c) {
    const int count = operand_count(op);
    const int operands[3] = {a, count > 1 ? b_ : 0, count > 2 ? c : 0};
    float values[3] = {0.0f, 0.0f, 0.0f};
    bool constant = true;
    for (int i = 0; i < count; i++) {
        const vd_function_node *node = &b->nodes[operands[i]];
        constant = constant && node->op == VD_NODE_CONSTANT;
        values[i] = node->value;
    }
    if (constant) {
        return vd_function_constant(b, vd_function_apply(op, values[0], values[1], values[2]));
    }
    if (op == VD_OP_SELECT && b->nodes[a].op == VD_NODE_CONSTANT) {
        return values[0] != 0.0f ? b_ : c;
    }
    vd_function_node node = {0.0f, (uint16_t)op, (uint16_t)operands[0], (uint16_t)operands[1],
                             (uint16_t)operands[2]};
    return add_node(b, &node);
}

int vd_function_power(vd_function_builder *b, int base, int exponent) {
    const vd_function_node *e = &b->nodes[exponent];
    if (e->op != VD_NODE_CONSTANT || !(fabsf(e->value) <= 64.0f) || floorf(e->value) != e->value) {
        return vd_function_node_make(b, VD_OP_POW, base, exponent, 0);
    }
    const float value = e->value;
    unsigned n = (unsigned)fabsf(value);
    int result = -1, square = base;
    for (; n > 0; n >>= 1) {
        if (n & 1u) {
            result =
                result < 0 ? square : vd_function_node_make(b, VD_OP_MULTIPLY, result, square, 0);
        }
        if (n > 1) {
            square = vd_function_node_make(b, VD_OP_MULTIPLY, square, square, 0);
        }
    }
    const int one = vd_function_constant(b, 1.0f);
    if (result < 0) {
        return one;
    }
    return value < 0.0f ? vd_function_node_make(b, VD_OP_DIVIDE, one, result, 0) : result;
}

void vd_function_hsv(vd_function_builder *b, int hue, int saturation, int value, int out[3]) {
    /* component = v − v s max(0, min(1, k, 4 − k)), k = (n + 6 hue) mod 6, n = 5, 3, 1 */
    static const float offsets[3] = {5.0f, 3.0f, 1.0f};
    const int zero = vd_function_constant(b, 0.0f), one = vd_function_constant(b, 1.0f);
    const int four = vd_function_constant(b, 4.0f), six = vd_function_constant(b, 6.0f);
    const int turns = vd_function_node_make(b, VD_OP_MULTIPLY, hue, six, 0);
    const int chroma = vd_function_node_make(b, VD_OP_MULTIPLY, value, saturation, 0);
    for (int i = 0; i < 3; i++) {
        const int n = vd_function_constant(b, offsets[i]);
        const int sum = vd_function_node_make(b, VD_OP_ADD, turns, n, 0);
        const int k = vd_function_node_make(b, VD_OP_MOD, sum, six, 0);
        const int back = vd_function_node_make(b, VD_OP_SUBTRACT, four, k, 0);
        int share = vd_function_node_make(b, VD_OP_MIN, k, back, 0);
        share = vd_function_node_make(b, VD_OP_MIN, share, one, 0);
        share = vd_function_node_make(b, VD_OP_MAX, share, zero, 0);
        share = vd_function_node_make(b, VD_OP_MULTIPLY, chroma, share, 0);
        out[i] = vd_function_node_make(b, VD_OP_SUBTRACT, value, share, 0);
    }
}

/* ---- registers --------------------------------------------------------------------------------
 */

typedef struct emitter {
    const vd_function_builder *builder;
    uint8_t needed[VD_FUNCTION_MAX_STEPS];       /* 1: for h; 2: for colours only */
    uint16_t order[VD_FUNCTION_MAX_STEPS];       /* nodes in the order of their steps */
    uint16_t last_use[VD_FUNCTION_MAX_STEPS];    /* position in `order`; UINT16_MAX: a result */
    uint16_t register_of[VD_FUNCTION_MAX_STEPS]; /* of every node that has one */
    uint16_t free_registers[VD_FUNCTION_MAX_REGISTERS];
    float constants[VD_FUNCTION_MAX_REGISTERS];
    vd_function_step steps[VD_FUNCTION_MAX_STEPS];
    int order_count, free_count, constant_count, register_count;
} emitter;

static bool is_operation(const vd_function_node *node) {
    return node->op < VD_OP_COUNT;
}

static void mark(emitter *e, uint8_t mark_as) {
    const vd_function_builder *b = e->builder;
    for (int i = b->node_count - 1; i >= 0; i--) {
        if (e->needed[i] != mark_as || !is_operation(&b->nodes[i])) {
            continue;
        }
        const uint16_t operands[3] = {b->nodes[i].a, b->nodes[i].b, b->nodes[i].c};
        const int count = operand_count((vd_function_op)b->nodes[i].op);
        for (int k = 0; k < count; k++) {
            if (e->needed[operands[k]] == 0) {
                e->needed[operands[k]] = mark_as;
            }
        }
    }
}

static void append(emitter *e, uint8_t marked_as) {
    for (int i = 0; i < e->builder->node_count; i++) {
        if (e->needed[i] == marked_as && is_operation(&e->builder->nodes[i])) {
            e->order[e->order_count++] = (uint16_t)i;
        }
    }
}

/* x, y and the constants; false when there are too many. */
static bool place_inputs(emitter *e) {
    e->register_of[0] = 0;
    e->register_of[1] = 1;
    for (int i = 2; i < e->builder->node_count; i++) {
        if (e->needed[i] != 0 && e->builder->nodes[i].op == VD_NODE_CONSTANT) {
            if (2 + e->constant_count == VD_FUNCTION_MAX_REGISTERS) {
                return false;
            }
            e->register_of[i] = (uint16_t)(2 + e->constant_count);
            e->constants[e->constant_count++] = e->builder->nodes[i].value;
        }
    }
    e->register_count = 2 + e->constant_count;
    return true;
}

static void find_last_uses(emitter *e, const int results[4], int result_count) {
    for (int i = 0; i < e->order_count; i++) {
        const vd_function_node *node = &e->builder->nodes[e->order[i]];
        e->last_use[node->a] = e->last_use[node->b] = e->last_use[node->c] = (uint16_t)i;
    }
    for (int i = 0; i < result_count; i++) {
        e->last_use[results[i]] = UINT16_MAX;
    }
}

/* Gives back the register of an operand that is used for the last time at position `at`. */
static void release(emitter *e, int node, int at) {
    if (is_operation(&e->builder->nodes[node]) && e->last_use[node] == at) {
        e->free_registers[e->free_count++] = e->register_of[node];
        e->last_use[node] = UINT16_MAX; /* once only: it may be two operands of one step */
    }
}

/* A step reads its operands before it writes, so its result may take the register of one. */
static bool place_steps(emitter *e) {
    for (int i = 0; i < e->order_count; i++) {
        const vd_function_node *node = &e->builder->nodes[e->order[i]];
        const int count = operand_count((vd_function_op)node->op);
        vd_function_step *step = &e->steps[i];
        step->op = node->op;
        step->a = e->register_of[node->a];
        step->b = count > 1 ? e->register_of[node->b] : 0;
        step->c = count > 2 ? e->register_of[node->c] : 0;
        release(e, node->a, i);
        if (count > 1) {
            release(e, node->b, i);
        }
        if (count > 2) {
            release(e, node->c, i);
        }
        if (e->free_count > 0) {
            step->to = e->free_registers[--e->free_count];
        } else if (e->register_count < VD_FUNCTION_MAX_REGISTERS) {
            step->to = (uint16_t)e->register_count++;
        } else {
            return false;
        }
        e->register_of[e->order[i]] = step->to;
    }
    return true;
}

static vd_status make_block(vd_context *context, const emitter *e, int height_steps,
                            const int results[4], bool has_color, vd_function **out) {
    vd_function head;
    memset(&head, 0, sizeof head);
    head.isa = (uint32_t)vd_context_isa(context);
    head.has_color = has_color;
    head.constant_count = (uint32_t)e->constant_count;
    head.register_count = (uint32_t)e->register_count;
    head.step_count = (uint32_t)e->order_count;
    head.height_steps = (uint32_t)height_steps;
    head.constants_offset = (uint32_t)sizeof head;
    head.steps_offset = head.constants_offset + head.constant_count * (uint32_t)sizeof(float);
    head.size_bytes = head.steps_offset + head.step_count * (uint32_t)sizeof(vd_function_step);
    for (int i = 0; i < (has_color ? 4 : 1); i++) {
        head.result[i] = e->register_of[results[i]];
    }
    uint8_t *block = vd_allocate(context, head.size_bytes, 1);
    if (block == NULL) {
        return vd_out_of_memory("a function", head.size_bytes);
    }
    memcpy(block, &head, sizeof head);
    memcpy(block + head.constants_offset, e->constants, head.constant_count * sizeof(float));
    memcpy(block + head.steps_offset, e->steps, head.step_count * sizeof(vd_function_step));
    *out = (vd_function *)(void *)block;
    return vd_success();
}

vd_status vd_function_emit(vd_context *context, const vd_function_builder *b, int h, const int *rgb,
                           vd_function **out) {
    emitter *e = vd_allocate_zero(context, 1, sizeof *e);
    if (e == NULL) {
        return vd_out_of_memory("compiling a function", sizeof *e);
    }
    e->builder = b;
    const int results[4] = {h, rgb != NULL ? rgb[0] : h, rgb != NULL ? rgb[1] : h,
                            rgb != NULL ? rgb[2] : h};
    e->needed[h] = 1;
    mark(e, 1);
    append(e, 1);
    const int height_steps = e->order_count;
    for (int i = 1; i < 4; i++) {
        e->needed[results[i]] = e->needed[results[i]] != 0 ? e->needed[results[i]] : 2;
    }
    mark(e, 2);
    append(e, 2);
    find_last_uses(e, results, 4);
    vd_status status;
    if (!place_inputs(e) || !place_steps(e)) {
        status = vd_failure(VD_ERROR_LIMIT,
                            "the function needs more than %d constants and intermediate values at "
                            "once; make it shorter",
                            VD_FUNCTION_MAX_REGISTERS);
    } else {
        status = make_block(context, e, height_steps, results, rgb != NULL, out);
    }
    vd_release(context, e);
    return status;
}
