/* The golf club-ball impact in C99: the same physics as golf_physics, for hosts without Python.

   One file for each layer of golf_physics, with its names, its order of operations and its
   constants: with the same C library the results have equal bits. An instance is one flat structure
   without pointers into itself, so that a copy of it is its state. No global variables, and no
   memory is allocated but for instances and saved states. Quantities are in SI units. */

#ifndef GOLF_H
#define GOLF_H

/* NaN and infinity are values here. Compilers that don't define these macros need an option for
   IEEE 754 arithmetic, too, if they don't have it by default (Intel's icc: -fp-model precise). */
#if defined __FAST_MATH__ || (defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__)
#error "compile without -ffast-math, -Ofast and -ffinite-math-only: results would be wrong"
#endif
#if defined _M_FP_FAST
#error "compile with /fp:precise, not /fp:fast: results would be wrong"
#endif

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Made by golf_build.native_header from golf_physics, where limits and tolerances have their reasons. */
#include "variables.h"

/* The same bits on all machines: no fused multiplication and addition, also where an importer
   compiles this with options of its own. */
#if defined __clang__
#pragma STDC FP_CONTRACT OFF
#elif defined __GNUC__
#pragma GCC optimize("fp-contract=off")
#endif

#define PI 3.141592653589793

/* VALUES */

/* Time since the start of the run, s: the sum of two doubles, so that an instant a nanosecond into a
   contact that began after a long approach is exact. */
typedef struct {
    double high, low;
} Instant;

/* What a host may change at every communication point. */
typedef struct {
    double k, b, club_speed, club_force;
} Inputs;

/* What initialization fixes, in the order of the table of variables. */
typedef struct {
    double m_club, m_ball, ball_diameter, ball_speed, gap, law, exponent, reference_compression,
        restitution_at_rest, restitution_slope;
} Parameters;

/* Both bodies at an instant; the differences compression = x_club - x_ball and closing = v_club -
   v_ball might lose digits. */
typedef struct {
    double x_club, x_ball, v_club, v_ball, compression, closing;
} Motion;

/* What a read of the outputs returns. */
typedef struct {
    double force, x_club, x_ball, v_club, v_ball, compression;
} State;

/* Contact force (N), compression (m), closing speed (m/s). */
typedef enum { FORCE, COMPRESSION, CLOSING } Quantity;

/* A largest value, and its time in s. */
typedef struct {
    double value, when;
} Peak;

/* Why a value, a call or a contact is refused: the place of the variable to be corrected in the table
   (SETTABLE: none, or the start time), and the numbers of the sentence: a value reference and a type,
   too. */
typedef struct {
    Reason reason;
    int place;
    double numbers[7];
    /* What a contact that can't be computed prevents: the sentence on that, with the last numbers. */
    Reason prevented;
} Refusal;

static const Refusal ACCEPTED = {FINE, 0, {0.0}, FINE};

/* The place of a variable in the table; -1: there is none with this value reference. */
static int place_of(uint32_t reference)
{
    return reference < sizeof PLACES ? PLACES[reference] : -1;
}

static Refusal refusal(Reason reason, double a, double b)
{
    return (Refusal){reason, SETTABLE, {a, b}, FINE};
}

static Refusal refusal_of(uint32_t reference, Reason reason, double a, double b)
{
    return (Refusal){reason, place_of(reference), {a, b}, FINE};
}

static double larger(double a, double b) { return b > a ? b : a; }
static double smaller(double a, double b) { return b < a ? b : a; }

/* The instant so much later, s, without loss (two-sum): 10^6 steps are as exact as one. */
static Instant added(Instant instant, double elapsed)
{
    double high = instant.high, low = instant.low;
    if (!high && !low) return (Instant){elapsed, 0.0};
    double total = high + elapsed;
    double back = total - high;
    low += (high - (total - back)) + (elapsed - back);
    /* The larger part is the sum's nearest double: the same one, however the steps were added. */
    double nearest = total + low;
    return (Instant){nearest, low - (nearest - total)};
}

/* From one instant to another, s. */
static double since(Instant begin, Instant instant)
{
    return (instant.high - begin.high) + (instant.low - begin.low);
}

#endif
