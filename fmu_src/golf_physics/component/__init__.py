"""One instance of the component, for any interface.

`component` steps, sets and reads; `outputs` defines each output; `state` serializes an instance;
`hybrid` adds Model Exchange, which only FMI 3.0 has, with the impact of `solved`.
"""
