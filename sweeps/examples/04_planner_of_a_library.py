"""A function of NumPy arrays as a planner, A* of networkx (pip install networkx): 04_planner_of_a_library.py [N]"""

import sys

import networkx as nx

import jaxbiped as jb


def networkx_astar(classes, levels, start_ij, goal_ij, costs):
    """Cells of a shortest way over free cells, along rows and columns."""
    graph = nx.grid_2d_graph(*classes.shape)
    free = jb.free_cells(classes, levels, start_ij)
    graph.remove_nodes_from([cell for cell in graph if not free[cell]])
    try:
        return nx.astar_path(graph, start_ij, goal_ij)
    except (nx.NetworkXNoPath, nx.NodeNotFound):
        return None


count = int(sys.argv[1]) if len(sys.argv) > 1 else 60
study = jb.Study(jb.RandomArenas(count=count), ["full", networkx_astar])
print(jb.evaluate(study).compare("networkx_astar", "full"))
